#include "tests/benchmarks/bench/scenes.h"

#include "tests/benchmarks/bench/scene_parts.h"

namespace sunder::bench {

const std::vector<NamedScene>& all_scenes() {
    static const std::vector<NamedScene> scenes = {
        {"bar320", "a bar of 4x4x20 particles, twisted", false, [] { return twisted_bar(4, 20); }},
        {"bar2673", "a bar of 9x9x33 particles, twisted", false, [] { return twisted_bar(9, 33); }},
        {"plate300", "a plate of 20x15 particles, hit by a weight", false, hit_plate},
        {"bunnies", "two bunnies of 300 fragments, hit by weights", false, two_bunnies},
        {"paper", "12 bunnies of 223 fragments fall and break", false, paper_scene},
        {"rubble", "892 loose fragments of bunnies fall, sleeping off", false, rubble},
        {"pile", "a thousand loose fragments at rest in a heap", false, pile},
        {"resting", "a hundred bodies of 27 fragments, 95 at rest", false, [] { return resting(true); }},
        {"restless", "the same with sleeping off", false, [] { return resting(false); }},
        {"1k", "a spinning cube of 1000 particles", false, [] { return cubes(1); }},
        {"10k", "10 of them", false, [] { return cubes(10); }},
        {"100k", "100 of them", true, [] { return cubes(100); }},
        {"1m", "1000 of them", true, [] { return cubes(1000); }},
    };
    return scenes;
}

}  // namespace sunder::bench
