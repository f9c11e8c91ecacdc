// How layers are called in PLY files: "corner_uv:Wall%20.001" is the UV map "Wall .001".
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "solver/data/mesh_layer.h"

namespace sunder {

/// "corner_uv:": domain and kind (float uv color weight int bool).
std::string layer_prefix(const LayerId& layer);

/// The prefix and the name, in which all but letters, digits and -._~ is written as % and two hexadecimal digits a byte
/// (RFC 3986, section 2.1).
std::string layer_property(const LayerId& layer);

/// The layer that a property is, its width left open; nothing if it is none. `is_face`: whether faces have it, else
/// vertices; `is_integer`: whether the file holds whole numbers.
std::optional<LayerId> layer_of_property(std::string_view property, bool is_face, bool is_integer);

/// Whether rows of a layer of that kind may have so many numbers.
bool is_layer_width(const LayerId& layer, size_t width);

}  // namespace sunder
