"""The preview's shader: skinning in the vertex stage, from a float texture of particle maps.

Eight RGBA texels a particle: the rows of the map from rest to world that is blended, its colour, the rows of the one that is
blended and then turned as the vertex is, and its own turn (x, y, z, w). A second texture lists particles and weights; each
vertex names its first row in it, the number of rows, and the particle whose colour it takes.
"""
import gpu
import numpy as np

WIDTH = 4096  # texels in a row of either texture; a multiple of eight, so that a particle lies in one row

_SKIN = """
vec4 particle_texel(int particle, int part)
{
  int at = particle * 8 + part;
  return texelFetch(particles, ivec2(at % WIDTH, at / WIDTH), 0);
}

vec3 particle_map(int particle, int first)
{
  vec4 at_rest = vec4(rest, 1.0);
  return vec3(dot(particle_texel(particle, first), at_rest),
              dot(particle_texel(particle, first + 1), at_rest),
              dot(particle_texel(particle, first + 2), at_rest));
}

vec2 influence_at(int row)
{
  return texelFetch(influences, ivec2(row % WIDTH, row / WIDTH), 0).xy;
}

vec3 skinned()
{
  vec2 heaviest = influence_at(follows.x);
  for (int row = follows.x + 1; row < follows.x + follows.y; ++row) {
    vec2 influence = influence_at(row);
    heaviest = influence.y > heaviest.y ? influence : heaviest;
  }
  vec4 near = particle_texel(int(heaviest.x + 0.5), 7);
  vec3 sum = vec3(0.0);
  vec3 arm = vec3(0.0);
  vec4 turn = vec4(0.0);
  for (int row = follows.x; row < follows.x + follows.y; ++row) {
    vec2 influence = influence_at(row);
    int particle = int(influence.x + 0.5);
    vec4 own = particle_texel(particle, 7);
    sum += influence.y * particle_map(particle, 0);
    arm += influence.y * particle_map(particle, 4);
    turn += (dot(own, near) < 0.0 ? -influence.y : influence.y) * own;
  }
  vec3 v = turn.xyz;
  float w = turn.w;
  vec3 turned = (w * w - dot(v, v)) * arm + 2.0 * dot(v, arm) * v + 2.0 * w * cross(v, arm);
  return sum + turned / dot(turn, turn);
}
"""

_DRAW = _SKIN + """
void main()
{
  position = skinned();
  color = particle_texel(follows.z, 3).rgb;
  gl_Position = to_screen * vec4(position, 1.0);
}
"""

# light: direction towards it, and how much it matters (0 for lines). Faces are lit from both sides.
_SHADE = """
void main()
{
  float shade = 1.0;
  if (light.w > 0.0) {
    vec3 normal = normalize(cross(dFdx(position), dFdy(position)));
    shade = mix(1.0, 0.35 + 0.75 * abs(dot(normal, light.xyz)), light.w);
  }
  pixel = vec4(color * tint.rgb * shade, tint.a);
}
"""

# Vertex i to pixel i: positions as the card computes them, for comparing.
_LIST = _SKIN + """
void main()
{
  position = skinned();
  int i = gl_VertexID;
  gl_Position = vec4((vec2(i % int(size.x), i / int(size.x)) + 0.5) / size.xy * 2.0 - 1.0, 0.0, 1.0);
  gl_PointSize = 1.0;
}
"""
_PUT = "void main() { pixel = vec4(position, 1.0); }"


def _make(vertex, fragment, constants, with_color):
    info = gpu.types.GPUShaderCreateInfo()
    info.define("WIDTH", str(WIDTH))
    info.vertex_in(0, "VEC3", "rest")
    info.vertex_in(1, "IVEC3", "follows")
    info.sampler(0, "FLOAT_2D", "particles")
    info.sampler(1, "FLOAT_2D", "influences")
    for kind, name in constants:
        info.push_constant(kind, name)
    passed = gpu.types.GPUStageInterfaceInfo("sunder_" + constants[0][1])
    passed.smooth("VEC3", "position")
    if with_color:
        passed.smooth("VEC3", "color")
    info.vertex_out(passed)
    info.fragment_out(0, "VEC4", "pixel")
    info.vertex_source(vertex)
    info.fragment_source(fragment)
    return gpu.shader.create_from_info(info)


def drawing_shader():
    return _make(_DRAW, _SHADE, [("MAT4", "to_screen"), ("VEC4", "light"), ("VEC4", "tint")], True)


def listing_shader():
    return _make(_LIST, _PUT, [("VEC4", "size")], False)


def texture(rows, kind):
    """(n, ...) f32 as a texture WIDTH wide; kind RGBA32F or RG32F. GPU textures cannot be written again: one a frame."""
    channels = {"RGBA32F": 4, "RG32F": 2}[kind]
    n_texels = rows.size // channels
    height = max(1, -(-n_texels // WIDTH))
    whole = np.zeros(height * WIDTH * channels, np.float32)
    whole[:rows.size] = rows.ravel()
    return gpu.types.GPUTexture((WIDTH, height), format=kind, data=gpu.types.Buffer("FLOAT", len(whole), whole))


_kept = {}  # a texture of no meaning, made when first needed


def bind(shader, particles, influences):
    """Hands the two textures to a shader that is bound.

    Each takes the place of one that stays: of a texture that was freed while another context of the graphics card had it,
    Blender 5.2 takes the next one that gets its name for bound already, and draws with the old one.
    """
    if not _kept:
        _kept["none"] = texture(np.zeros((1, 2), np.float32), "RG32F")
    for name, wanted in (("particles", particles), ("influences", influences)):
        shader.uniform_sampler(name, _kept["none"])
        shader.uniform_sampler(name, wanted)


def forget():
    """Frees what is kept; for when the add-on goes."""
    _kept.clear()


class Skin:
    """A Geometry on the graphics card; stays while no edge breaks."""

    def __init__(self, geometry):
        layout = gpu.types.GPUVertFormat()
        layout.attr_add(id="rest", comp_type="F32", len=3, fetch_mode="FLOAT")
        layout.attr_add(id="follows", comp_type="I32", len=3, fetch_mode="INT")
        self._vertices = gpu.types.GPUVertBuf(layout, max(1, len(geometry.rest)))
        if len(geometry.rest):
            self._vertices.attr_fill("rest", geometry.rest)
            self._vertices.attr_fill("follows", geometry.follows)
        self.influences = texture(geometry.influences, "RG32F")
        self.outer, self.inner = self._batch("TRIS", geometry.outer), self._batch("TRIS", geometry.inner)
        self.lines = self._batch("LINES", geometry.lines)
        self.points = gpu.types.GPUBatch(type="POINTS", buf=self._vertices)

    def _batch(self, kind, elements):
        if not len(elements):
            return None
        indices = gpu.types.GPUIndexBuf(type=kind, seq=np.ascontiguousarray(elements, np.int32))
        return gpu.types.GPUBatch(type=kind, buf=self._vertices, elem=indices)


def listed_positions(shader, skin, n_vertices, particles):
    """Positions (v, 3) f32 as the vertex stage makes them. Needs a graphics context."""
    width = min(WIDTH, n_vertices)
    height = -(-n_vertices // width)
    target = gpu.types.GPUOffScreen(width, height, format="RGBA32F")
    with target.bind():
        framebuffer = gpu.state.active_framebuffer_get()
        framebuffer.clear(color=(0, 0, 0, 0))
        gpu.state.blend_set("NONE")
        gpu.state.depth_test_set("NONE")
        gpu.state.point_size_set(1)
        shader.bind()
        shader.uniform_float("size", (width, height, 0, 0))
        bind(shader, particles, skin.influences)
        skin.points.draw(shader)
        pixels = framebuffer.read_color(0, 0, width, height, 4, 0, "FLOAT")
    pixels.dimensions = 4 * width * height
    found = np.array(pixels, np.float32).reshape(-1, 4)[:n_vertices]
    target.free()
    return found[:, :3]
