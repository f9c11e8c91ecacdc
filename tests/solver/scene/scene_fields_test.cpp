#include "solver/scene/scene_fields.h"

#include <gtest/gtest.h>

#include <set>

#include "solver/data/frame_state.h"
#include "solver/scene/rest_conditions.h"

namespace sunder {
namespace {

template <class T>
void expect_checked(std::span<const Field<T>> fields) {
    std::set<std::string> names;
    for (const Field<T>& field : fields) {
        const FieldDescription& d = field.description;
        EXPECT_TRUE(names.insert(d.name).second) << d.name << " is described twice";
        T values;
        EXPECT_TRUE(values.check("here")) << d.name << " may not be what it begins with";
        if (std::holds_alternative<bool T::*>(field.member)) continue;
        const auto refused = [&](double value) {
            field.visit(values, [&]<class N>(N& io_value) { io_value = static_cast<N>(value); });
            const Status ok = values.check("here");
            return !ok && ok.error().parameter == d.name && ok.error().where == "here";
        };
        EXPECT_TRUE(refused(d.min_excluded ? d.min : d.min - 1)) << d.name;
        if (d.max < kNever) {
            EXPECT_TRUE(refused(d.max + 1)) << d.name;
        }
        if (std::holds_alternative<double T::*>(field.member)) {
            EXPECT_TRUE(refused(std::numeric_limits<double>::quiet_NaN())) << d.name;
        }
    }
}

TEST(scene_fields, each_is_checked_by_its_range) {
    expect_checked(material_fields());
    expect_checked(settings_fields());
}

// A change of any of them wakes what sleeps.
TEST(scene_fields, each_of_a_material_is_hashed) {
    FrameInput input;
    input.materials.resize(1);
    const auto before = rest_conditions(input, true, FrameEnd::end, {});
    for (const Field<Material>& field : material_fields()) {
        FrameInput other = input;
        field.visit(other.materials[0], []<class T>(T& io_value) {
            if constexpr (std::is_same_v<T, bool>)
                io_value = !io_value;
            else if constexpr (std::is_integral_v<T>)
                io_value = 1;
            else
                io_value = 0.25;
        });
        EXPECT_NE(rest_conditions(other, true, FrameEnd::end, {}), before) << field.description.name;
    }
}

// As they were written into states before there were fields: what slept then sleeps on.
TEST(scene_fields, a_material_has_the_hash_that_it_had) {
    FrameInput input;
    Material m;
    m.youngs_modulus = 1, m.poisson_ratio = 2, m.damping_time = 3, m.yield = 4, m.flow_rate = 5, m.hardening = 6;
    m.toughness = 7, m.compressive_toughness = 8, m.stiffness = 9, m.friction = 10, m.restitution = 11;
    input.materials = {m};
    const double numbers[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
    EXPECT_EQ(rest_conditions(input, true, FrameEnd::end, {}).back(), hash_of(numbers));
    input.materials[0].curvature = false;
    EXPECT_NE(rest_conditions(input, true, FrameEnd::end, {}).back(), hash_of(numbers));
}

}  // namespace
}  // namespace sunder
