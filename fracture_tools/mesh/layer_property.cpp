#include "fracture_tools/mesh/layer_property.h"

#include <array>

#include "fracture_tools/mesh/utf8_text.h"

namespace sunder {
namespace {

constexpr std::array<std::string_view, 3> kDomains = {"point", "corner", "face"};
constexpr std::array<std::string_view, 6> kKinds = {"float", "uv", "color", "weight", "int", "bool"};
constexpr std::string_view kDigits = "0123456789ABCDEF";

bool is_plain(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.' ||
           c == '_' || c == '~';
}

/// Value of a hexadecimal digit, or npos.
size_t digit(char c) { return kDigits.find(c >= 'a' && c <= 'f' ? char(c - 'a' + 'A') : c); }

std::string decoded(std::string_view text) {
    std::string name;
    for (size_t i = 0; i < text.size(); ++i) {
        const bool is_escape = text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) != kDigits.npos &&
                               digit(text[i + 2]) != kDigits.npos;
        name += is_escape ? char(16 * digit(text[i + 1]) + digit(text[i + 2])) : text[i];
        if (is_escape) i += 2;
    }
    return to_utf8(name);
}

}  // namespace

std::string layer_prefix(const LayerId& layer) {
    return std::string(kDomains[size_t(layer.domain)]) + '_' + std::string(kKinds[size_t(layer.kind)]) + ':';
}

std::string layer_property(const LayerId& layer) {
    std::string property = layer_prefix(layer);
    for (const char c : layer.name) {
        const auto byte = static_cast<unsigned char>(c);
        if (is_plain(c))
            property += c;
        else
            property += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
    return property;
}

std::optional<LayerId> layer_of_property(std::string_view property, bool is_face, bool is_integer) {
    for (size_t d = 0; d < kDomains.size(); ++d)
        for (size_t k = 0; k < kKinds.size(); ++k) {
            LayerId layer{{}, LayerDomain(d), LayerKind(k)};
            const std::string prefix = layer_prefix(layer);
            if (!property.starts_with(prefix)) continue;
            const bool fits = (layer.domain != LayerDomain::point) == is_face && !layer.is_blended() == is_integer &&
                              (layer.kind != LayerKind::uv || layer.domain == LayerDomain::corner) &&
                              (layer.kind != LayerKind::weight || layer.domain == LayerDomain::point);
            if (!fits) return std::nullopt;
            layer.name = decoded(property.substr(prefix.size()));
            return layer;
        }
    return std::nullopt;
}

bool is_layer_width(const LayerId& layer, size_t width) {
    switch (layer.kind) {
        case LayerKind::uv:
            return width == 2;
        case LayerKind::color:
            return width == 4;
        case LayerKind::weight:
            return width == 1;
        default:
            return width >= 1 && width <= LayerId::kWidest;
    }
}

}  // namespace sunder
