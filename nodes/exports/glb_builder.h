// The two chunks of a binary glTF (Khronos, glTF 2.0 specification, 4.4) as they grow.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "nodes/exports/shot_looks.h"
#include "nodes/files/byte_buffer.h"
#include "nodes/graph/description.h"
#include "nodes/graph/json.h"

namespace sunder {

enum : int { kUnsignedInt = 5125, kFloat = 5126, kArrayBuffer = 34962, kElementBuffer = 34963 };

class Glb {
public:
    Glb() {
        json_["asset"] = {{"version", "2.0"}, {"generator", "sunder shot 1, written by sunder " SUNDER_VERSION}};
        json_["scene"] = 0;
        json_["scenes"] = Json::array({{{"nodes", Json::array()}}});
        for (const char* name : {"nodes", "meshes", "materials", "accessors", "bufferViews"})
            json_[name] = Json::array();
    }

    Json& json() { return json_; }

    size_t add(const char* list, Json entry) {
        json_[list].push_back(std::move(entry));
        return json_[list].size() - 1;
    }

    /// A material, once if equal ones are asked for; names of extensions are listed once.
    size_t add_material(const Surface& s) {
        if (const auto known = materials_.find(s); known != materials_.end()) return known->second;
        constexpr std::array<double, 4> kWhite = {1, 1, 1, 1};  // by which colours of vertices are multiplied
        const std::array<double, 4>& color = s.takes_vertex_colors ? kWhite : s.color;
        Json material = {
            {"name", s.name},
            {"pbrMetallicRoughness",
             {{"baseColorFactor", color}, {"metallicFactor", s.metallic}, {"roughnessFactor", s.roughness}}}};
        if (color[3] < 1 || s.takes_vertex_alpha) material["alphaMode"] = "BLEND";
        if (s.transmission > 0) {
            material["extensions"]["KHR_materials_transmission"] = {{"transmissionFactor", s.transmission}};
            json_["extensionsUsed"] = Json::array({"KHR_materials_transmission"});
        }
        return materials_[s] = add("materials", std::move(material));
    }

    /// Numbers of one attribute; T is uint32_t or a row of floats. `target` 0: no vertex data.
    template <class T>
    size_t accessor(const std::vector<T>& values, const char* type, int component, int target, bool has_bounds) {
        Json view = {{"buffer", 0}, {"byteOffset", binary_.view().size()}, {"byteLength", sizeof(T) * values.size()}};
        if (target) view["target"] = target;
        binary_.append(values.data(), sizeof(T) * values.size());
        Json entry = {{"bufferView", add("bufferViews", view)},
                      {"componentType", component},
                      {"count", values.size()},
                      {"type", type}};
        if constexpr (!std::is_same_v<T, uint32_t>)
            if (has_bounds) {
                std::vector<float> low, high;
                for (size_t k = 0; k < sizeof(T) / sizeof(float); ++k) {
                    low.push_back(number(values[0], k)), high.push_back(number(values[0], k));
                    for (const T& v : values)
                        low[k] = std::min(low[k], number(v, k)), high[k] = std::max(high[k], number(v, k));
                }
                entry["min"] = low, entry["max"] = high;
            }
        return add("accessors", entry);
    }

    ByteBuffer file() {
        json_["buffers"] = Json::array({{{"byteLength", binary_.view().size()}}});
        std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
        text.append((4 - text.size() % 4) % 4, ' ');
        const uint32_t binary = static_cast<uint32_t>(binary_.view().size());  // whole numbers and floats: 4 divides it
        ByteBuffer out;
        out.text("glTF"), out.number(uint32_t{2});
        out.number(static_cast<uint32_t>(12 + 8 + text.size() + 8 + binary));
        out.number(static_cast<uint32_t>(text.size())), out.text("JSON"), out.text(text);
        out.number(binary), out.append("BIN", 4), out.append(binary_.view().data(), binary);
        return out;
    }
    size_t binary_bytes() const { return binary_.view().size(); }

private:
    template <class T>
    static float number(const T& row, size_t k) {
        if constexpr (std::is_same_v<T, float>)
            return row;
        else
            return row[static_cast<Eigen::Index>(k)];
    }
    Json json_;
    ByteBuffer binary_;
    std::map<Surface, size_t> materials_;
};

}  // namespace sunder
