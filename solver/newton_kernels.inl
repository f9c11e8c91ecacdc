// Included once for each instruction set, after which SUNDER_NEWTON_KERNELS names the table.
#include "solver/lanes.h"
#include "solver/newton_kernels.h"

namespace sunder {
namespace {

using Vector = Float8[3];

SUNDER_INLINE Float8 eight(const float* from) { return load<Float8>(from); }

SUNDER_INLINE Float8 dot(const Float8* a, const Float8* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Symmetric matrix (Sym3, lane by lane) times a vector.
SUNDER_INLINE void multiply(const float (&S)[6][8], const Vector& v, Vector& out) {
    const Float8 xy = eight(S[3]), xz = eight(S[4]), yz = eight(S[5]);
    out[0] = eight(S[0]) * v[0] + xy * v[1] + xz * v[2];
    out[1] = xy * v[0] + eight(S[1]) * v[1] + yz * v[2];
    out[2] = xz * v[0] + yz * v[1] + eight(S[2]) * v[2];
}

// z and M z of a block.
struct Preconditioned {
    Float8 z[6];
    Vector force, torque;
};
SUNDER_INLINE void take(const CgParticles& p, const Float8 (&s)[6], Preconditioned& out) {
    const Float8 inverse = eight(p.inverse_diagonal), mass = eight(p.mass);
    for (int i = 0; i < 6; ++i) out.z[i] = inverse * s[i];
    for (int i = 0; i < 3; ++i) out.force[i] = mass * out.z[i];
    const Vector turn = {out.z[3], out.z[4], out.z[5]};
    multiply(p.inertia, turn, out.torque);
}

// Momentum of z, and z . M s.
SUNDER_INLINE void put(const CgArrays& a, const Preconditioned& z, const Float8 (&s)[6], size_t block) {
    const Float8 zero = {};
    const Float8 force[4] = {z.force[0], z.force[1], z.force[2], zero};
    const Float8 torque[4] = {z.torque[0], z.torque[1], z.torque[2], zero};
    scatter4<8>(a.momentum + 64 * block, 0, force);
    scatter4<8>(a.momentum + 64 * block, 4, torque);
    a.magnitude[block] = static_cast<double>(sum(dot(z.force, s) + dot(z.torque, s + 3)));
}

void precondition(const CgArrays& a, size_t begin, size_t end) {
    for (size_t block = begin; block < end; ++block) {
        Float8 s[6];
        for (int i = 0; i < 6; ++i) s[i] = eight(a.particles[block].residual[i]);
        Preconditioned z;
        take(a.particles[block], s, z);
        put(a, z, s, block);
    }
}

void fit_groups(const CgArrays& a, size_t begin, size_t end) {
    for (size_t block = begin; block < end; ++block) {
        Vector shift = {}, spin = {};
        Float8 A[3][3] = {};
        for (size_t r = a.row_begin[block]; r < a.row_begin[block + 1]; ++r) {
            const CgRow& row = a.rows[r];
            const uint32_t* members = a.neighbours + 8 * r;
            const Float8 weight = eight(row.weight);
            Float8 force[4], torque[4];
            gather4<8>(a.momentum, members, 0, force);
            const Vector q = {eight(row.q[0]), eight(row.q[1]), eight(row.q[2])};
            for (int i = 0; i < 3; ++i) {
                const Float8 f = weight * force[i];
                shift[i] += f;
                for (int k = 0; k < 3; ++k) A[i][k] += f * q[k];
            }
            gather4<8>(a.momentum, members, 4, torque);
            for (int i = 0; i < 3; ++i) spin[i] += weight * torque[i];
        }
        const CgGroups& g = a.groups[block];
        Float8 RQ[3][3], RW[3][3];
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) RQ[i][k] = eight(g.RQ[i][k]), RW[i][k] = eight(g.RW[i][k]);
        spin[0] = a.orientation_weight * spin[0] + (dot(A[2], RQ[1]) - dot(A[1], RQ[2]));
        spin[1] = a.orientation_weight * spin[1] + (dot(A[0], RQ[2]) - dot(A[2], RQ[0]));
        spin[2] = a.orientation_weight * spin[2] + (dot(A[1], RQ[0]) - dot(A[0], RQ[1]));
        Vector turn;
        multiply(g.K_inverse, spin, turn);
        const Float8 volume_strain = dot(A[0], RW[0]) + dot(A[1], RW[1]) + dot(A[2], RW[2]);
        const Float8 b = eight(g.b);
        Float8 T[3][3];  // -b P,  P = -[turn]x R Q - A N + volume_strain R W
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, l = (i + 2) % 3;
            Vector affine;
            const Vector row = {A[i][0], A[i][1], A[i][2]};
            multiply(g.N, row, affine);
            for (int k = 0; k < 3; ++k)
                T[i][k] = b * (turn[j] * RQ[l][k] - turn[l] * RQ[j][k] + affine[k] - volume_strain * RW[i][k]);
        }
        const Float8 scale = eight(g.center_scale), turn_weight = a.orientation_weight * b;
        float* out = a.pulls + 128 * block;
        const Float8 zero = {};
        const Float8 first[4] = {scale * shift[0], scale * shift[1], scale * shift[2], T[0][0]};
        const Float8 second[4] = {T[0][1], T[0][2], T[1][0], T[1][1]};
        const Float8 third[4] = {T[1][2], T[2][0], T[2][1], T[2][2]};
        const Float8 fourth[4] = {turn_weight * turn[0], turn_weight * turn[1], turn_weight * turn[2], zero};
        scatter4<16>(out, 0, first);
        scatter4<16>(out, 4, second);
        scatter4<16>(out, 8, third);
        scatter4<16>(out, 12, fourth);
    }
}

void gather_product(const CgArrays& a, size_t begin, size_t end) {
    for (size_t block = begin; block < end; ++block) {
        Vector shift = {}, turn = {};
        for (size_t r = a.row_begin[block]; r < a.row_begin[block + 1]; ++r) {
            const CgRow& row = a.rows[r];
            const uint32_t* groups = a.neighbours + 8 * r;
            const Float8 weight = eight(row.weight);
            const Vector q = {eight(row.q_other[0]), eight(row.q_other[1]), eight(row.q_other[2])};
            Float8 first[4], second[4], third[4], fourth[4];
            gather4<16>(a.pulls, groups, 0, first);
            gather4<16>(a.pulls, groups, 4, second);
            shift[0] += weight * (first[0] + (first[3] * q[0] + second[0] * q[1] + second[1] * q[2]));
            gather4<16>(a.pulls, groups, 8, third);
            shift[1] += weight * (first[1] + (second[2] * q[0] + second[3] * q[1] + third[0] * q[2]));
            shift[2] += weight * (first[2] + (third[1] * q[0] + third[2] * q[1] + third[3] * q[2]));
            gather4<16>(a.pulls, groups, 12, fourth);
            for (int i = 0; i < 3; ++i) turn[i] += weight * fourth[i];
        }
        CgParticles& p = a.particles[block];
        Float8 s[6];
        for (int i = 0; i < 6; ++i) s[i] = eight(p.residual[i]);
        Preconditioned z;
        take(p, s, z);
        Float8 product[6];
        for (int i = 0; i < 3; ++i) {
            product[i] = eight(p.product[i]) + (eight(p.own_shift) * z.z[i] - shift[i]);
            product[i + 3] = eight(p.product[i + 3]) + (eight(p.own_turn) * z.z[i + 3] - turn[i]);
        }
        for (int i = 0; i < 6; ++i) store(p.product[i], product[i]);
        a.curvature[block] = static_cast<double>(sum(dot(z.force, product) + dot(z.torque, product + 3)));
    }
}

void advance(const CgArrays& a, float alpha, float beta, size_t begin, size_t end) {
    for (size_t block = begin; block < end; ++block) {
        CgParticles& p = a.particles[block];
        const Float8 inverse = eight(p.inverse_diagonal), zero = {};
        Float8 s[6];
        for (int i = 0; i < 6; ++i) {
            s[i] = eight(p.residual[i]);
            const Float8 direction = inverse * s[i] + beta * eight(p.direction[i]);
            const Float8 image = eight(p.product[i]) + beta * eight(p.image[i]);
            s[i] -= alpha * image;
            store(p.direction[i], direction);
            store(p.image[i], image);
            store(p.solution[i], eight(p.solution[i]) + alpha * direction);
            store(p.residual[i], s[i]);
            store(p.product[i], zero);
        }
        Preconditioned z;
        take(p, s, z);
        put(a, z, s, block);
    }
}

}  // namespace

const NewtonKernels SUNDER_NEWTON_KERNELS = {precondition, fit_groups, gather_product, advance};

}  // namespace sunder
