// prefracture: cuts a solid mesh into fragments.
#include <algorithm>
#include <array>

#include "fracture_tools/fragments/prefracture.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

constexpr std::array<std::pair<const char*, CutMethod>, 2> kMethods = {
    {{"voronoi", CutMethod::voronoi}, {"kmeans", CutMethod::kmeans}}};
constexpr std::array<std::pair<const char*, CellSource>, 2> kSources = {
    {{"tets", CellSource::tets}, {"voronoi", CellSource::voronoi}}};
constexpr std::array<std::pair<const char*, SiteKind>, 7> kSites = {{{"kmeans", SiteKind::kmeans},
                                                                     {"uniform", SiteKind::uniform},
                                                                     {"poisson", SiteKind::poisson},
                                                                     {"impact", SiteKind::impact},
                                                                     {"grid", SiteKind::grid},
                                                                     {"points", SiteKind::points},
                                                                     {"density", SiteKind::density}}};
constexpr std::array<std::pair<const char*, ImpactShape>, 2> kShapes = {
    {{"points", ImpactShape::points}, {"curve", ImpactShape::curve}}};

constexpr std::array<std::pair<const char*, RepairMode>, 4> kRepairs = {{{"auto", RepairMode::automatic},
                                                                         {"keep", RepairMode::keep},
                                                                         {"wrap", RepairMode::wrap},
                                                                         {"refuse", RepairMode::refuse}}};

template <class Choices>
auto chosen(const Choices& choices, const std::string& name) {
    return std::ranges::find(choices, name, [](const auto& c) { return std::string(c.first); })->second;
}
template <class Choices>
std::vector<JsonValue> names(const Choices& choices) {
    std::vector<JsonValue> list;
    for (const auto& [name, value] : choices) list.emplace_back(name);
    return list;
}

PrefractureSettings prefracture_settings(const Parameters& p) {
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
    settings.sites.sheets = p.text("sheets") == "auto";
    settings.roughness = p.integer("roughness");
    settings.least_piece = p.number("least_piece");
    settings.source = chosen(kSources, p.text("source"));
    settings.cells_per_piece = p.number("cells_per_piece");
    settings.sharp_angle = p.number("sharp_angle");
    settings.repair.mode = chosen(kRepairs, p.text("repair"));
    settings.repair.thickness = p.number("thickness");
    if (!p.is_automatic("weld_distance")) settings.repair.weld_distance = p.number("weld_distance");
    settings.repair.wrap_detail = p.number("wrap_detail");
    settings.interior = {.detail = p.number("interior_detail"),
                         .noise = p.number("noise"),
                         .noise_scale = p.number("noise_scale"),
                         .noise_seed = settings.seed,
                         .rim_width = p.number("rim_width"),
                         .smooth_angle = p.number("interior_smooth_angle")};
    settings.maps = {p.text("toughness_map"), p.text("yield_map"), p.text("density_map")};
    settings.clusters = p.integer("clusters");
    settings.cluster_toughness = p.number("cluster_toughness");
    settings.weak_interface_share = p.number("weak_interface_share");
    return settings;
}

Status check_prefracture(const std::string& node, const Parameters& p) {
    if (p.integer("clusters") > p.integer("pieces"))
        return node_error(node, "clusters", "is more than the number of pieces", "at most `pieces`");
    if (p.text("method") != "voronoi") return {};
    const SiteKind kind = chosen(kSites, p.text("sites"));
    if ((kind == SiteKind::points || kind == SiteKind::impact) && p.points("points").empty())
        return node_error(node, "points", "is empty, and sites '" + p.text("sites") + "' go by it", "give points");
    if (kind == SiteKind::density && p.text("density_group").empty())
        return node_error(node, "density_group", "is empty, and sites 'density' go by it", "name a vertex group");
    return {};
}

Result<Value> cook_prefracture(CookContext& context) {
    Result<std::shared_ptr<const TriMesh>> mesh = context.input<TriMesh>("mesh");
    if (!mesh) return mesh.error();
    PrefractureSettings settings = prefracture_settings(context.parameters());
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
         .choices = names(kSites),
         .needs = {{is("method", {"voronoi"})}}},
        {.name = "points",
         .label = "Points",
         .type = ParameterType::points,
         .unit = "m",
         .min = -1e6,
         .max = 1e6,
         .default_value = JsonValue::empty_list(),
         .sentence = "In the mesh's coordinates: where it is hit (sites impact), or the sites themselves (sites "
                     "points)",
         .needs = {{is("method", {"voronoi"}), is("sites", {"impact", "points"})}}},
        {.name = "impact_shape",
         .label = "Impact Shape",
         .type = ParameterType::choice,
         .default_value = "points",
         .sentence = "What `points` are with sites impact. points: each is hit; curve: the line through them is",
         .choices = names(kShapes),
         .needs = {{is("method", {"voronoi"}), is("sites", {"impact"})}}},
        {.name = "impact_radius",
         .label = "Impact Radius",
         .unit = "m",
         .min = 0,
         .max = 1e6,
         .min_excluded = true,
         .default_value = 0.1,
         .sentence = "Within it pieces of an impact are alike; beyond it their size grows with the distance",
         .needs = {{is("method", {"voronoi"}), is("sites", {"impact"})}}},
        {.name = "grid_jitter",
         .label = "Grid Jitter",
         .min = 0,
         .max = 1,
         .default_value = 0.3,
         .sentence = "How far sites of a grid leave their places; 0: cubes, 1: anywhere in their grid cells",
         .needs = {{is("method", {"voronoi"}), is("sites", {"grid"})}}},
        {.name = "density_group",
         .label = "Density Group",
         .type = ParameterType::text,
         .default_value = "",
         .sentence = "Vertex group of the mesh, or vertex attribute from 0 to 1, that sites density gather at",
         .needs = {{is("method", {"voronoi"}), is("sites", {"density"})}}},
        {.name = "density_factor",
         .label = "Density Factor",
         .min = 1,
         .max = 1000,
         .default_value = 8.0,
         .sentence = "How many times more pieces a volume has at the density group than away from it",
         .needs = {{is("method", {"voronoi"}), is("sites", {"density"})}}},
        {.name = "sheets",
         .label = "Sheets",
         .type = ParameterType::choice,
         .default_value = "auto",
         .sentence =
             "auto: where the mesh is thinner than a piece is large, sites lie in the middle between its faces, "
             "evenly spread: one piece through the thickness, walls along it; sites grid and points stay. off: "
             "anywhere within the thickness",
         .choices = {"auto", "off"},
         .group = "Pieces",
         .needs = {{is("method", {"voronoi"}), is("sites", {"kmeans", "uniform", "poisson", "impact", "density"})},
                   {is("method", {"voronoi"}), is_above("roughness", 1)},
                   {is("method", {"kmeans"}), is("source", {"voronoi"})}}},
        {.name = "roughness",
         .label = "Roughness",
         .type = ParameterType::integer,
         .min = 1,
         .max = 64,
         .default_value = 1,
         .sentence = "Voronoi cells that a piece is made of: 1 has flat break surfaces, 8 rough ones, with several "
                     "times as many triangles",
         .group = "Break Surfaces",
         .needs = {{is("method", {"voronoi"})}}},
        {.name = "least_piece",
         .label = "Least Piece",
         .min = 0,
         .max = 1,
         .default_value = 0.05,
         .sentence = "Pieces of method voronoi below this share of their neighbours' volume join the neighbour that "
                     "they share most area with",
         .group = "Pieces",
         .needs = {{is("method", {"voronoi"}), is("roughness", {1})}}}};
}

std::vector<ParameterDescription> repair_parameters() {
    return {
        {.name = "repair",
         .label = "Repair",
         .type = ParameterType::choice,
         .default_value = "auto",
         .sentence = "What is done about a mesh that is no solid; what was done is told as a warning. keep: the mesh's "
                     "own triangles stay, welded, oriented, holes closed; wrap: a new surface around them; auto: keep, "
                     "or where that cannot be cut, wrap; refuse: nothing, it is an error",
         .choices = names(kRepairs),
         .former_values = {{true, "auto"}, {false, "keep"}}},
        {.name = "thickness",
         .label = "Thickness",
         .type = ParameterType::number,
         .unit = "m",
         .min = 0,
         .max = 1e6,
         .default_value = 0.0,
         .sentence = "Open sheets become walls as thick as this, their surface the outer side; 0: they are refused",
         .needs = {{is("repair", {"auto", "keep", "wrap"})}}},
        {.name = "weld_distance",
         .label = "Weld Distance",
         .type = ParameterType::number,
         .unit = "m",
         .min = 0,
         .max = 1e6,
         .default_value = kAutomatic,
         .sentence = "How far apart the sides of a seam may lie to be welded, where the mesh is open; auto: found from "
                     "the gap between boundary edges that run side by side; 0: equal positions alone",
         .automatic = true,
         .needs = {{is("repair", {"auto", "keep"})}, {is("repair", {"wrap"}), is_above("thickness", 0)}}},
        {.name = "wrap_detail",
         .label = "Wrap Detail",
         .type = ParameterType::number,
         .min = 0.002,
         .max = 0.2,
         .default_value = 0.02,
         .sentence = "Share of the mesh's diagonal: gaps and details narrower than this are lost in a wrap; smaller "
                     "ones cost triangles",
         .needs = {{is("repair", {"auto", "wrap"})}}}};
}

std::vector<ParameterDescription> interior_parameters() {
    return {
        {.name = "noise",
         .label = "Noise",
         .min = 0,
         .max = 0.5,
         .default_value = 0.0,
         .sentence = "How far break surfaces leave their planes, as a share of a piece's size (cube root of the mean "
                     "volume). Both sides stay the same, the outer surface stays where it is, and what would "
                     "intersect moves less; 0: not at all"},
        {.name = "noise_scale",
         .label = "Noise Scale",
         .min = 0.05,
         .max = 10,
         .default_value = 0.5,
         .sentence = "Distance between bumps of the noise, as a share of a piece's size; break surfaces get four "
                     "edges a bump",
         .needs = {{is_above("noise", 0)}}},
        {.name = "interior_detail",
         .label = "Interior Detail",
         .min = 0,
         .max = 10,
         .default_value = 0.0,
         .sentence = "Longest edge of break surfaces, as a share of a piece's size; 0: as they are cut, or as the "
                     "noise needs"},
        {.name = "interior_smooth_angle",
         .label = "Interior Smooth Angle",
         .unit = "degrees",
         .min = 0,
         .max = 180,
         .default_value = 20.0,
         .sentence = "Break surfaces are shaded smooth across edges flatter than this; 0: every triangle is flat"},
        {.name = "rim_width",
         .label = "Rim Width",
         .unit = "m",
         .min = 0,
         .max = 1e6,
         .default_value = 0.0,
         .sentence = "The attribute `rim` of break surfaces is 1 where they meet the outer surface and falls to 0 "
                     "within this; it follows the surface's triangles, which `interior_detail` makes finer"}};
}

void add(const char* group, std::vector<ParameterDescription> some, std::vector<ParameterDescription>& io_parameters) {
    for (ParameterDescription& p : some) io_parameters.push_back(in_group(group, std::move(p)));
}

ParameterDescription map_parameter(const char* name, const char* label, const char* of) {
    return {.name = name,
            .label = label,
            .type = ParameterType::text,
            .default_value = "",
            .sentence =
                std::string("Vertex attribute of the mesh, or red, green, blue or alpha of its colours, that is the "
                            "factor on the body's ") +
                of + " from place to place; empty: none"};
}

std::vector<ParameterDescription> factor_parameters() {
    return {map_parameter("toughness_map", "Toughness Map", "toughness"),
            map_parameter("yield_map", "Yield Map", "yield"),
            map_parameter("density_map", "Density Map", "density"),
            {.name = "clusters",
             .label = "Clusters",
             .type = ParameterType::integer,
             .min = 0,
             .max = 100000,
             .default_value = 0,
             .sentence = "Number of large pieces that the body breaks into first, each then into its fragments; 0: "
                         "fragments are not gathered"},
            {.name = "cluster_toughness",
             .label = "Cluster Toughness",
             .min = 1,
             .max = kMostFactor,
             .default_value = 4.0,
             .sentence = "Factor on the toughness of interfaces within a cluster",
             .needs = {{is_above("clusters", 0)}}},
            {.name = "weak_interface_share",
             .label = "Weak Interface Share",
             .min = 0,
             .max = 1,
             .default_value = 0.0,
             .sentence = "Interfaces of a smaller area, as a share of its fragments' cross-section, do not hold by "
                         "themselves: they part with what is around them"}};
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
                     "triangles, UVs and normals stay. kmeans: small cells of `source` gathered into "
                     "pieces of like size, with rough break surfaces",
         .choices = names(kMethods)},
        {.name = "pieces",
         .label = "Pieces",
         .type = ParameterType::integer,
         .min = 1,
         .max = 100000,
         .default_value = 300,
         .sentence = "Number of fragments wanted; sites grid and points have about or exactly their own",
         .needs = {{is("method", {"kmeans"})},
                   {is("sites", {"kmeans", "uniform", "poisson", "impact", "grid", "density"})}}},
        {.name = "seed",
         .label = "Seed",
         .type = ParameterType::integer,
         .min = 0,
         .default_value = 0,
         .sentence = "Chooses among cuts of the same kind; the same seed gives the same cut"}};
    for (ParameterDescription& p : site_parameters()) d.parameters.push_back(std::move(p));
    d.parameters.push_back({.name = "source",
                            .label = "Source",
                            .type = ParameterType::choice,
                            .default_value = "tets",
                            .sentence = "Cells that method kmeans gathers. tets: tetrahedra, the paper's way, the "
                                        "surface is meshed anew; voronoi: small Voronoi cells, the mesh's own surface "
                                        "stays",
                            .choices = names(kSources),
                            .needs = {{is("method", {"kmeans"})}}});
    d.parameters.push_back(
        {.name = "cells_per_piece",
         .label = "Cells per Piece",
         .type = ParameterType::number,
         .min = 4,
         .max = 1000,
         .default_value = 30.0,
         .sentence =
             "Cells that method kmeans aims at for each fragment: more tetrahedra follow the surface closer and cost "
             "more",
         .needs = {{is("method", {"kmeans"})}}});
    d.parameters.push_back({.name = "sharp_angle",
                            .label = "Sharp Angle",
                            .type = ParameterType::number,
                            .unit = "degrees",
                            .min = 0,
                            .max = 180,
                            .default_value = 0.0,
                            .sentence = "Edges sharper than this stay edges with method kmeans; 0 decides by the mesh",
                            .group = "Pieces",
                            .needs = {{is("method", {"kmeans"}), is("source", {"tets"})}}});
    add("Repair", repair_parameters(), d.parameters);
    add("Break Surfaces", interior_parameters(), d.parameters);
    add("Strength", factor_parameters(), d.parameters);
    return {.description = d, .cook = cook_prefracture, .check = check_prefracture, .is_cut = true};
}

}  // namespace sunder
