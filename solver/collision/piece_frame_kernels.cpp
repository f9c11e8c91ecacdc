// What the particles of a piece do beyond its rigid motion, four side by side. The frame is that of piece_frame.h.
// Compiled once for each instruction set (lanes.h).
#include "solver/collision/piece_frame_kernels.h"

#include "solver/lanes/lane_vectors.h"

namespace sunder {
namespace {

// Of records of three numbers.
SUNDER_INLINE V3 gather3(const double* records, const size_t (&at)[4]) {
    Double2 xy[4];
    double z[4];
    for (int i = 0; i < 4; ++i) xy[i] = load<Double2>(records + 3 * at[i]), z[i] = records[3 * at[i] + 2];
    const Lanes even = join(xy[0], xy[2]), odd = join(xy[1], xy[3]);  // x0 y0 x2 y2, x1 y1 x3 y3
    return {firsts(even, odd), seconds(even, odd), join(Double2{z[0], z[1]}, Double2{z[2], z[3]})};
}

SUNDER_INLINE void add_lanes(V3 v, double* io_sum) {
    io_sum[0] += sum(v.x), io_sum[1] += sum(v.y), io_sum[2] += sum(v.z);
}

SUNDER_INLINE V3 all3(const double* v) { return {all(v[0]), all(v[1]), all(v[2])}; }

// Places of the block, and who lies there; beyond the end the first.
struct Block {
    size_t place[4], particle[4];
    SUNDER_INLINE Block(const PieceMembers& m, size_t block) {
        for (size_t i = 0; i < 4; ++i) {
            place[i] = 4 * block + i < m.n ? 4 * block + i : 0;
            particle[i] = m.member[place[i]];
        }
    }
};

void rigid_motion(const PieceMembers& m, size_t begin, size_t end, double* io_sum) {
    const V3 origin = all3(m.position + 3 * size_t{m.member[0]}), common = all3(m.velocity + 3 * size_t{m.member[0]});
    const V3 zero = {all(0), all(0), all(0)};
    V3 position = zero, velocity = zero, momentum = zero, squares = zero, products = zero;
    for (size_t b = begin; b < end; ++b) {
        const Block block(m, b);  // the first, which stands in beyond the end, adds nothing to any sum
        const V3 x = gather3(m.position, block.particle) - origin, v = gather3(m.velocity, block.particle) - common;
        position = position + x, velocity = velocity + v, momentum = momentum + cross(x, v);
        squares = squares + V3{x.x * x.x, x.y * x.y, x.z * x.z};
        products = products + V3{x.x * x.y, x.x * x.z, x.y * x.z};
    }
    const V3 sums[5] = {position, velocity, momentum, squares, products};
    for (int i = 0; i < 5; ++i) add_lanes(sums[i], io_sum + 3 * i);
}

void turn(const PieceMembers& m, const double* center, const double* remembered, size_t begin, size_t end,
          double* io_sum) {
    const V3 c = all3(center), zero = {all(0), all(0), all(0)};
    V3 rows[3] = {zero, zero, zero};
    for (size_t b = begin; b < end; ++b) {
        const Block block(m, b);
        const double there[4] = {1, 4 * b + 1 < m.n ? 1.0 : 0.0, 4 * b + 2 < m.n ? 1.0 : 0.0,
                                 4 * b + 3 < m.n ? 1.0 : 0.0};
        const V3 x = load<Lanes>(there) * (gather3(m.position, block.particle) - c);
        const V3 r = gather3(remembered, block.place);
        rows[0] = rows[0] + x.x * r, rows[1] = rows[1] + x.y * r, rows[2] = rows[2] + x.z * r;
    }
    for (int i = 0; i < 3; ++i) add_lanes(rows[i], io_sum + 3 * i);
}

SUNDER_INLINE Lanes smaller(Lanes x, Lanes y) { return select<Lanes>(x < y, x, y); }

struct Boxes {
    V3 lower, upper;
};

// The particle's ball, moved by what it does beyond the piece's rigid motion.
SUNDER_INLINE Boxes boxes_of(const PieceMembers& m, const FrameMotion& motion, const Block& block) {
    const double radii[4] = {m.radius[block.particle[0]], m.radius[block.particle[1]], m.radius[block.particle[2]],
                             m.radius[block.particle[3]]};
    const V3 r = gather3(m.position, block.particle) - all3(motion.center);
    const V3 v = gather3(m.velocity, block.particle) - all3(motion.velocity);
    const V3 way = all(motion.duration) * (v - cross(all3(motion.spin), r));
    const Lanes radius = load<Lanes>(radii);
    const Lanes bent = radius + all(motion.bend) * (radius + root(dot(way, way)));
    const Lanes reach = all(1 + 1e-9) * bent;  // beyond rounding
    const auto back = [&](V3 x) {
        return V3{dot(all3(motion.back), x), dot(all3(motion.back + 3), x), dot(all3(motion.back + 6), x)};
    };
    const V3 from = back(r), to = from + back(way), around = {reach, reach, reach};
    return {V3{smaller(from.x, to.x), smaller(from.y, to.y), smaller(from.z, to.z)} - around,
            V3{larger(from.x, to.x), larger(from.y, to.y), larger(from.z, to.z)} + around};
}

void boxes(const PieceMembers& m, const FrameMotion& motion, size_t begin, size_t end, double* o_boxes) {
    for (size_t b = begin; b < end; ++b) {
        const Block block(m, b);
        double lower[3][4], upper[3][4];
        const Boxes found = boxes_of(m, motion, block);
        store3(lower, found.lower), store3(upper, found.upper);
        for (size_t i = 0; i < 4 && 4 * b + i < m.n; ++i)
            for (int axis = 0; axis < 3; ++axis)
                o_boxes[6 * (4 * b + i) + axis] = lower[axis][i], o_boxes[6 * (4 * b + i) + 3 + axis] = upper[axis][i];
    }
}

void who_left(const PieceMembers& m, const FrameMotion& motion, const double* grown, size_t begin, size_t end,
              uint8_t* o_left) {
    for (size_t b = begin; b < end; ++b) {
        const Block block(m, b);
        const Boxes now = boxes_of(m, motion, block);
        const double* const outer[4] = {grown + 6 * block.place[0], grown + 6 * block.place[1],
                                        grown + 6 * block.place[2], grown + 6 * block.place[3]};
        Lanes first[4], last[4];  // lower corner; from the lower z on
        gather_numbers(outer, 0, first), gather_numbers(outer, 2, last);
        const LaneMask is_held = (now.lower.x > first[0]) & (now.lower.y > first[1]) & (now.lower.z > first[2]) &
                                 (now.upper.x < last[1]) & (now.upper.y < last[2]) & (now.upper.z < last[3]);
        uint8_t bits = 0;
        if (any(~is_held)) {
            long long lanes[4];
            __builtin_memcpy(lanes, &is_held, sizeof(lanes));
            for (size_t i = 0; i < 4; ++i)
                if (lanes[i] == 0 && 4 * b + i < m.n) bits = static_cast<uint8_t>(bits | 1u << i);
        }
        o_left[b] = bits;
    }
}

}  // namespace

const PieceFrameKernels SUNDER_KERNELS(kPieceFrameKernels) = {rigid_motion, turn, boxes, who_left};

}  // namespace sunder
