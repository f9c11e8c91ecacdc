// prefracture: cuts a solid mesh into fragments.
#include <algorithm>
#include <array>

#include "fracture_tools/prefracture.h"
#include "nodes/node_list.h"

namespace sunder {
namespace {

constexpr std::array<std::pair<const char*, CutMethod>, 2> kMethods = {
    {{"voronoi", CutMethod::voronoi}, {"kmeans", CutMethod::kmeans}}};
constexpr std::array<std::pair<const char*, SiteKind>, 7> kSites = {{{"kmeans", SiteKind::kmeans},
                                                                     {"uniform", SiteKind::uniform},
                                                                     {"poisson", SiteKind::poisson},
                                                                     {"impact", SiteKind::impact},
                                                                     {"grid", SiteKind::grid},
                                                                     {"points", SiteKind::points},
                                                                     {"density", SiteKind::density}}};
constexpr std::array<std::pair<const char*, ImpactShape>, 2> kShapes = {
    {{"points", ImpactShape::points}, {"curve", ImpactShape::curve}}};

template <class Choices>
auto chosen(const Choices& choices, const std::string& name) {
    return std::ranges::find(choices, name, [](const auto& c) { return std::string(c.first); })->second;
}
template <class Choices>
std::vector<Json> names(const Choices& choices) {
    std::vector<Json> list;
    for (const auto& [name, value] : choices) list.emplace_back(name);
    return list;
}

PrefractureSettings settings_of(const Parameters& p) {
    PrefractureSettings settings;
    settings.method = chosen(kMethods, p.text("method"));
    settings.pieces = p.integer("pieces");
    settings.seed = static_cast<uint32_t>(p.integer("seed"));
    settings.sites.kind = chosen(kSites, p.text("sites"));
    settings.sites.points = p.points("points");
    settings.sites.shape = chosen(kShapes, p.text("impact_shape"));
    settings.sites.impact_radius = p.number("impact_radius");
    settings.sites.grid_jitter = p.number("grid_jitter");
    settings.sites.density_group = p.text("density_group");
    settings.sites.density_factor = p.number("density_factor");
    settings.roughness = p.integer("roughness");
    settings.least_piece = p.number("least_piece");
    settings.cells_per_piece = p.number("cells_per_piece");
    settings.sharp_angle = p.number("sharp_angle");
    settings.repair = p.boolean("repair");
    return settings;
}

Status check(const std::string& node, const Parameters& p) {
    if (p.text("method") != "voronoi") return {};
    const SiteKind kind = chosen(kSites, p.text("sites"));
    if ((kind == SiteKind::points || kind == SiteKind::impact) && p.points("points").empty())
        return node_error(node, "points", "is empty, and sites '" + p.text("sites") + "' go by it", "give points");
    if (kind == SiteKind::density && p.text("density_group").empty())
        return node_error(node, "density_group", "is empty, and sites 'density' go by it", "name a vertex group");
    return {};
}

Result<Value> cook(CookContext& context) {
    Result<std::shared_ptr<const TriMesh>> mesh = context.input<TriMesh>("mesh");
    if (!mesh) return mesh.error();
    PrefractureSettings settings = settings_of(context.parameters());
    settings.threads = context.threads();
    Result<FragmentSet> fragments = prefracture(**mesh, settings, "node '" + context.node() + "'", context.progress());
    if (!fragments) return fragments.error();
    return make_value(fragments.take());
}

std::vector<ParameterDescription> site_parameters() {
    return {
        {.name = "sites",
         .label = "Sites",
         .type = ParameterType::choice,
         .default_value = "kmeans",
         .sentence = "Where method voronoi has its pieces. kmeans: pieces of like size; uniform: anywhere, large and "
                     "small ones; poisson: spread, but irregular; impact: the smaller the nearer to `points`; grid: "
                     "cubes; points: one piece around each of `points`; density: more of them near `density_group`",
         .choices = names(kSites)},
        {.name = "points",
         .label = "Points",
         .type = ParameterType::points,
         .unit = "m",
         .min = -1e6,
         .max = 1e6,
         .default_value = Json::array(),
         .sentence = "In the mesh's coordinates: where it is hit (sites impact), or the sites themselves (sites "
                     "points)"},
        {.name = "impact_shape",
         .label = "Impact Shape",
         .type = ParameterType::choice,
         .default_value = "points",
         .sentence = "What `points` are with sites impact. points: each is hit; curve: the line through them is",
         .choices = names(kShapes)},
        {.name = "impact_radius",
         .label = "Impact Radius",
         .unit = "m",
         .min = 0,
         .max = 1e6,
         .min_excluded = true,
         .default_value = 0.1,
         .sentence = "Within it pieces of an impact are alike; beyond it their size grows with the distance"},
        {.name = "grid_jitter",
         .label = "Grid Jitter",
         .min = 0,
         .max = 1,
         .default_value = 0.3,
         .sentence = "How far sites of a grid leave their places; 0: cubes, 1: anywhere in their grid cells"},
        {.name = "density_group",
         .label = "Density Group",
         .type = ParameterType::text,
         .default_value = "",
         .sentence = "Vertex group of the mesh that sites density gather at"},
        {.name = "density_factor",
         .label = "Density Factor",
         .min = 1,
         .max = 1000,
         .default_value = 8.0,
         .sentence = "How many times more pieces a volume has at the density group than away from it"},
        {.name = "roughness",
         .label = "Roughness",
         .type = ParameterType::integer,
         .min = 1,
         .max = 64,
         .default_value = 1,
         .sentence = "Voronoi cells that a piece is made of: 1 has flat break surfaces, 8 rough ones, with several "
                     "times as many triangles"},
        {.name = "least_piece",
         .label = "Least Piece",
         .min = 0,
         .max = 1,
         .default_value = 0.05,
         .sentence = "Pieces of method voronoi below this share of their neighbours' volume join the neighbour that "
                     "they share most area with"}};
}

}  // namespace

NodeType prefracture_node() {
    NodeDescription d{.type = "prefracture",
                      .label = "Pre-Fracture",
                      .category = "fracture",
                      .sentence = "Cuts a closed mesh into fragments that share their break surfaces exactly."};
    d.inputs = {{.name = "mesh",
                 .label = "Mesh",
                 .type = SocketType::mesh,
                 .sentence = "A closed surface that bounds a solid"}};
    d.outputs = {{.name = "fragments",
                  .label = "Fragments",
                  .type = SocketType::fragments,
                  .sentence = "Closed pieces and the interfaces between them"}};
    d.parameters = {
        {.name = "method",
         .label = "Method",
         .type = ParameterType::choice,
         .default_value = "voronoi",
         .sentence = "voronoi: along the Voronoi cells of `sites`, with flat break surfaces; the mesh's own "
                     "triangles, UVs and normals stay. kmeans: tetrahedra gathered into pieces of like "
                     "size, with rough break surfaces; the surface is meshed anew",
         .choices = names(kMethods)},
        {.name = "pieces",
         .label = "Pieces",
         .type = ParameterType::integer,
         .min = 1,
         .max = 100000,
         .default_value = 300,
         .sentence = "Number of fragments wanted; sites grid and points have about or exactly their own"},
        {.name = "seed",
         .label = "Seed",
         .type = ParameterType::integer,
         .min = 0,
         .default_value = 0,
         .sentence = "Chooses among cuts of the same kind; the same seed gives the same cut"}};
    for (ParameterDescription& p : site_parameters()) d.parameters.push_back(std::move(p));
    d.parameters.push_back(
        {.name = "cells_per_piece",
         .label = "Cells per Piece",
         .type = ParameterType::number,
         .min = 4,
         .max = 1000,
         .default_value = 30.0,
         .sentence = "Tetrahedra that method kmeans aims at for each fragment: more follow the surface closer and cost "
                     "more"});
    d.parameters.push_back(
        {.name = "sharp_angle",
         .label = "Sharp Angle",
         .type = ParameterType::number,
         .unit = "degrees",
         .min = 0,
         .max = 180,
         .default_value = 0.0,
         .sentence = "Edges sharper than this stay edges with method kmeans; 0 decides by the mesh"});
    d.parameters.push_back({.name = "repair",
                            .label = "Repair",
                            .type = ParameterType::boolean,
                            .default_value = true,
                            .sentence = "Welds, orients and closes small holes of the mesh first, with a warning"});
    return {.description = d, .cook = cook, .check = check};
}

}  // namespace sunder
