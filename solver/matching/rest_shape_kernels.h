// Rest shapes of four groups at a time.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sunder {

/// What rest shapes are made of, and where they go.
struct RestShapeRecords {
    const double* positions;                      // at rest (n_particles x 3)
    const double* plastic_deformation;            // F_P, column by column (n_particles x 9)
    const double *masses, *moments;               // of GroupShapes (n_particles, n_particles x 6)
    const double* edge_weights;                   // (n_edges)
    const uint32_t *begin, *end, *member, *edge;  // of LiveTopology
    double moment_weight;                         // kStretchMomentWeight
    double* shapes;                               // GroupShape (n_particles x kShapeNumbers)
    double* members;                              // MemberShape: q, weight (n_slots x 4)

    static constexpr size_t kShapeNumbers = 45, kMemberNumbers = 4;
    static constexpr size_t kNumbers = 44;  // of a shape, that are written: all but its key
};

struct RestShapeKernels {
    /// No group's bits depend on the three beside it; a group may be among them more than once.
    void (*build)(const RestShapeRecords&, const uint32_t (&groups)[4]);
};

extern const RestShapeKernels kRestShapeKernelsPortable, kRestShapeKernelsAvx2, kRestShapeKernelsAvx512;

}  // namespace sunder
