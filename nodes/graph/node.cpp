#include "nodes/graph/node.h"

#include "nodes/graph/json.h"

namespace sunder {

bool Parameters::is_null(std::string_view name) const { return value(name).is_null(); }
bool Parameters::is_automatic(std::string_view name) const { return value(name) == kAutomatic; }
bool Parameters::boolean(std::string_view name) const { return value(name).get<bool>(); }
int Parameters::integer(std::string_view name) const { return value(name).get<int>(); }
double Parameters::number(std::string_view name) const { return value(name).get<double>(); }
std::string Parameters::text(std::string_view name) const { return value(name).get<std::string>(); }

double Parameters::number_or(std::string_view name, double if_null) const {
    const Json v = value(name);
    return v.is_null() ? if_null : v.get<double>();
}

Vec3 Parameters::vector3(std::string_view name) const {
    const Json v = value(name);
    return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()};
}

std::array<int, 3> Parameters::integer3(std::string_view name) const {
    const Json v = value(name);
    return {v[0].get<int>(), v[1].get<int>(), v[2].get<int>()};
}

std::vector<Vec3> Parameters::points(std::string_view name) const {
    std::vector<Vec3> points;
    for (const Json& p : value(name)) points.emplace_back(p[0].get<double>(), p[1].get<double>(), p[2].get<double>());
    return points;
}

Error CookContext::error(const std::string& parameter, std::string what, std::string mend) const {
    return node_error(node(), parameter, std::move(what), std::move(mend));
}

Error node_error(const std::string& node, const std::string& parameter, std::string what, std::string mend) {
    std::string where = "node '" + node + "'";
    if (!parameter.empty()) where += ", parameter '" + parameter + "'";
    Error error = bad_input(std::move(where), std::move(what), std::move(mend));
    error.node = node;
    error.parameter = parameter;
    return error;
}

}  // namespace sunder
