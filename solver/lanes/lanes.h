// Numbers side by side, for kernels: eight floats, and four or eight doubles. Included only by files that are compiled
// once for each instruction set; all in an anonymous namespace, so that no linker mixes them up. The operations are the
// same, in the same order and rounded alike: every instruction set gives the same bits.
#pragma once

#include <cstddef>
#include <cstdint>

#define SUNDER_INLINE inline __attribute__((always_inline))

#ifdef __AVX2__
#include <immintrin.h>
#endif

// The name of a table of kernels for the set that is being compiled.
#define SUNDER_KERNELS_OF(name, set) name##set
#define SUNDER_KERNELS_OF_SET(name, set) SUNDER_KERNELS_OF(name, set)
#define SUNDER_KERNELS(name) SUNDER_KERNELS_OF_SET(name, SUNDER_KERNEL_SET)

namespace sunder {
namespace {

using Float4 = float __attribute__((vector_size(16)));
using Double2 = double __attribute__((vector_size(16)));

#ifdef __AVX2__

using Float8 = float __attribute__((vector_size(32)));
using Double4 = double __attribute__((vector_size(32)));

// One instruction, straight from memory; of a shuffle GCC 12 makes up to four.
SUNDER_INLINE Float8 join(Float4 low, Float4 high) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
}
SUNDER_INLINE Double4 join(Double2 low, Double2 high) {
    return _mm256_insertf128_pd(_mm256_castpd128_pd256(low), high, 1);
}

template <class V>
using Mask = decltype(V() < V());
template <class V>
SUNDER_INLINE V select(Mask<V> mask, V yes, V no) {
    return mask ? yes : no;
}
template <class M>
SUNDER_INLINE bool any(M mask) {
    long long __attribute__((vector_size(32))) bits;
    __builtin_memcpy(&bits, &mask, sizeof(M));
    return !__builtin_ia32_ptestz256(bits, bits);
}
SUNDER_INLINE bool any(Mask<Float4> mask) { return __builtin_ia32_movmskps(reinterpret_cast<Float4>(mask)) != 0; }
SUNDER_INLINE Float4 root(Float4 a) { return __builtin_ia32_sqrtps(a); }
SUNDER_INLINE Float4 maximum(Float4 a, Float4 b) { return __builtin_ia32_maxps(a, b); }
SUNDER_INLINE Float8 root(Float8 a) { return __builtin_ia32_sqrtps256(a); }
SUNDER_INLINE Double4 root(Double4 a) { return __builtin_ia32_sqrtpd256(a); }
SUNDER_INLINE Float8 maximum(Float8 a, Float8 b) { return __builtin_ia32_maxps256(a, b); }  // a > b ? a : b
SUNDER_INLINE Double4 maximum(Double4 a, Double4 b) { return __builtin_ia32_maxpd256(a, b); }
SUNDER_INLINE Float4 low(Float8 a) { return __builtin_shufflevector(a, a, 0, 1, 2, 3); }
SUNDER_INLINE Float4 high(Float8 a) { return __builtin_shufflevector(a, a, 4, 5, 6, 7); }
SUNDER_INLINE Double2 low(Double4 a) { return __builtin_shufflevector(a, a, 0, 1); }
SUNDER_INLINE Double2 high(Double4 a) { return __builtin_shufflevector(a, a, 2, 3); }
SUNDER_INLINE Double4 firsts(Double4 a, Double4 b) { return __builtin_shufflevector(a, b, 0, 4, 2, 6); }
SUNDER_INLINE Double4 seconds(Double4 a, Double4 b) { return __builtin_shufflevector(a, b, 1, 5, 3, 7); }

#else

template <class Half>
struct HalfMasks {
    Half lo, hi;
    friend SUNDER_INLINE HalfMasks operator&(HalfMasks a, HalfMasks b) { return {a.lo & b.lo, a.hi & b.hi}; }
    friend SUNDER_INLINE HalfMasks operator|(HalfMasks a, HalfMasks b) { return {a.lo | b.lo, a.hi | b.hi}; }
    SUNDER_INLINE HalfMasks operator~() const { return {~lo, ~hi}; }
};

template <class Half, class Number>
struct Halves {
    Half lo, hi;
    friend SUNDER_INLINE Halves operator+(Halves a, Halves b) { return {a.lo + b.lo, a.hi + b.hi}; }
    friend SUNDER_INLINE Halves operator-(Halves a, Halves b) { return {a.lo - b.lo, a.hi - b.hi}; }
    friend SUNDER_INLINE Halves operator*(Halves a, Halves b) { return {a.lo * b.lo, a.hi * b.hi}; }
    friend SUNDER_INLINE Halves operator/(Halves a, Halves b) { return {a.lo / b.lo, a.hi / b.hi}; }
    friend SUNDER_INLINE Halves operator*(Number a, Halves b) { return {a * b.lo, a * b.hi}; }
    friend SUNDER_INLINE Halves operator+(Number a, Halves b) { return {a + b.lo, a + b.hi}; }
    friend SUNDER_INLINE Halves operator+(Halves a, Number b) { return {a.lo + b, a.hi + b}; }
    friend SUNDER_INLINE Halves operator-(Number a, Halves b) { return {a - b.lo, a - b.hi}; }
    friend SUNDER_INLINE Halves operator/(Number a, Halves b) { return {a / b.lo, a / b.hi}; }
    friend SUNDER_INLINE auto operator<(Halves a, Halves b) {
        return HalfMasks<decltype(a.lo < b.lo)>{a.lo < b.lo, a.hi < b.hi};
    }
    friend SUNDER_INLINE auto operator>(Halves a, Halves b) { return b < a; }
    SUNDER_INLINE Halves operator-() const { return {-lo, -hi}; }
    SUNDER_INLINE Halves& operator+=(Halves b) { return *this = *this + b; }
    SUNDER_INLINE Halves& operator-=(Halves b) { return *this = *this - b; }
};
using Float8 = Halves<Float4, float>;
using Double4 = Halves<Double2, double>;

template <class V>
using Mask = decltype(V() < V());
template <class V>
SUNDER_INLINE V select(Mask<V> mask, V yes, V no) {
    if constexpr (requires { mask.lo; })
        return {mask.lo ? yes.lo : no.lo, mask.hi ? yes.hi : no.hi};
    else
        return mask ? yes : no;
}
template <class Half>
SUNDER_INLINE bool any(Half mask) {
    long long bits[2];
    __builtin_memcpy(bits, &mask, sizeof(bits));
    return (bits[0] | bits[1]) != 0;
}
template <class Half>
SUNDER_INLINE bool any(HalfMasks<Half> mask) {
    return any(mask.lo | mask.hi);
}
SUNDER_INLINE Float4 root(Float4 a) {
    for (size_t i = 0; i < 4; ++i) a[i] = __builtin_sqrtf(a[i]);
    return a;
}
SUNDER_INLINE Double2 root(Double2 a) { return Double2{__builtin_sqrt(a[0]), __builtin_sqrt(a[1])}; }
template <class Half, class Number>
SUNDER_INLINE Halves<Half, Number> root(Halves<Half, Number> a) {
    return {root(a.lo), root(a.hi)};
}
SUNDER_INLINE Float4 maximum(Float4 a, Float4 b) { return a > b ? a : b; }
template <class Half, class Number>
SUNDER_INLINE Halves<Half, Number> maximum(Halves<Half, Number> a, Halves<Half, Number> b) {
    return select<Halves<Half, Number> >(a > b, a, b);
}
SUNDER_INLINE Float8 join(Float4 low, Float4 high) { return {low, high}; }
SUNDER_INLINE Double4 join(Double2 low, Double2 high) { return {low, high}; }
SUNDER_INLINE Float4 low(Float8 a) { return a.lo; }
SUNDER_INLINE Float4 high(Float8 a) { return a.hi; }
SUNDER_INLINE Double2 low(Double4 a) { return a.lo; }
SUNDER_INLINE Double2 high(Double4 a) { return a.hi; }
SUNDER_INLINE Double4 firsts(Double4 a, Double4 b) {
    return {__builtin_shufflevector(a.lo, b.lo, 0, 2), __builtin_shufflevector(a.hi, b.hi, 0, 2)};
}
SUNDER_INLINE Double4 seconds(Double4 a, Double4 b) {
    return {__builtin_shufflevector(a.lo, b.lo, 1, 3), __builtin_shufflevector(a.hi, b.hi, 1, 3)};
}

#endif

// As many doubles as one register holds, four at least.
#ifdef __AVX512F__

using Double8 = double __attribute__((vector_size(64)));
using Doubles = Double8;

SUNDER_INLINE Double8 join(Double4 low, Double4 high) {
    return _mm512_maskz_insertf64x4(0xff, _mm512_castpd256_pd512(low), high, 1);
}
SUNDER_INLINE bool any(Mask<Double8> mask) { return _mm512_movepi64_mask(reinterpret_cast<__m512i>(mask)) != 0; }
SUNDER_INLINE Double8 root(Double8 a) { return _mm512_maskz_sqrt_pd(0xff, a); }
SUNDER_INLINE Double4 low(Double8 a) { return __builtin_shufflevector(a, a, 0, 1, 2, 3); }
SUNDER_INLINE Double4 high(Double8 a) { return __builtin_shufflevector(a, a, 4, 5, 6, 7); }

#else

using Doubles = Double4;

#endif

template <class V, class Number>
SUNDER_INLINE V load(const Number* from) {
    V v;
    __builtin_memcpy(&v, from, sizeof(V));
    return v;
}

template <class V, class Number>
SUNDER_INLINE void store(Number* to, V v) {
    __builtin_memcpy(to, &v, sizeof(V));
}

// Four numbers of each of eight records: out[i] holds the i-th of all.
SUNDER_INLINE void transpose(Float4 a, Float4 b, Float4 c, Float4 d, Float4 (&out)[4]) {
    const Float4 ab01 = __builtin_shufflevector(a, b, 0, 4, 1, 5), ab23 = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    const Float4 cd01 = __builtin_shufflevector(c, d, 0, 4, 1, 5), cd23 = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    out[0] = __builtin_shufflevector(ab01, cd01, 0, 1, 4, 5);
    out[1] = __builtin_shufflevector(ab01, cd01, 2, 3, 6, 7);
    out[2] = __builtin_shufflevector(ab23, cd23, 0, 1, 4, 5);
    out[3] = __builtin_shufflevector(ab23, cd23, 2, 3, 6, 7);
}

#ifdef __AVX2__
template <class V>
SUNDER_INLINE void transpose(const V (&in)[4], V (&out)[4]) {  // of eight numbers each: 4x4 in each half
    const V ab01 = __builtin_shufflevector(in[0], in[1], 0, 8, 1, 9, 4, 12, 5, 13);
    const V ab23 = __builtin_shufflevector(in[0], in[1], 2, 10, 3, 11, 6, 14, 7, 15);
    const V cd01 = __builtin_shufflevector(in[2], in[3], 0, 8, 1, 9, 4, 12, 5, 13);
    const V cd23 = __builtin_shufflevector(in[2], in[3], 2, 10, 3, 11, 6, 14, 7, 15);
    out[0] = __builtin_shufflevector(ab01, cd01, 0, 1, 8, 9, 4, 5, 12, 13);
    out[1] = __builtin_shufflevector(ab01, cd01, 2, 3, 10, 11, 6, 7, 14, 15);
    out[2] = __builtin_shufflevector(ab23, cd23, 0, 1, 8, 9, 4, 5, 12, 13);
    out[3] = __builtin_shufflevector(ab23, cd23, 2, 3, 10, 11, 6, 7, 14, 15);
}
#else
SUNDER_INLINE void transpose(const Float8 (&in)[4], Float8 (&out)[4]) {
    Float4 l[4], h[4];
    transpose(in[0].lo, in[1].lo, in[2].lo, in[3].lo, l);
    transpose(in[0].hi, in[1].hi, in[2].hi, in[3].hi, h);
    for (int i = 0; i < 4; ++i) out[i] = {l[i], h[i]};
}
#endif

// A lane alone.
SUNDER_INLINE bool any(bool mask) { return mask; }
SUNDER_INLINE float root(float a) { return __builtin_sqrtf(a); }
SUNDER_INLINE float maximum(float a, float b) { return a > b ? a : b; }

// Numbers [offset, offset + 4) of the records of eight lanes; `stride` numbers a record.
template <size_t stride, class Number, class Eight>
SUNDER_INLINE void gather4(const Number* records, const uint32_t* lanes, size_t offset, Eight (&out)[4]) {
    using Four = decltype(low(Eight()));
    Eight in[4];
    for (int i = 0; i < 4; ++i)
        in[i] = join(load<Four>(records + stride * lanes[i] + offset),
                     load<Four>(records + stride * lanes[i + 4] + offset));
    transpose(in, out);
}

// The reverse, for the eight records that start at `record`.
template <size_t stride, class Number, class Eight>
SUNDER_INLINE void scatter4(Number* record, size_t offset, const Eight (&in)[4]) {
    Eight out[4];
    transpose(in, out);
    for (int i = 0; i < 4; ++i) {
        store(record + stride * i + offset, low(out[i]));
        store(record + stride * (i + 4) + offset, high(out[i]));
    }
}

// The same for four lanes.
template <size_t stride>
SUNDER_INLINE void gather4(const float* records, const uint32_t* lanes, size_t offset, Float4 (&out)[4]) {
    const auto in = [&](int i) { return load<Float4>(records + stride * lanes[i] + offset); };
    transpose(in(0), in(1), in(2), in(3), out);
}
template <size_t stride>
SUNDER_INLINE void gather4(const double* records, const uint32_t* lanes, size_t offset, Double4 (&out)[4]) {
    for (int half = 0; half < 2; ++half) {
        Double2 in[4];
        for (int i = 0; i < 4; ++i) in[i] = load<Double2>(records + stride * lanes[i] + offset + 2 * half);
        const Double4 even = join(in[0], in[2]), odd = join(in[1], in[3]);
        out[2 * half] = firsts(even, odd), out[2 * half + 1] = seconds(even, odd);
    }
}

template <size_t stride>
SUNDER_INLINE void scatter4(double* record, size_t offset, const Double4 (&in)[4]) {
    for (int half = 0; half < 2; ++half) {
        const Double4 &a = in[2 * half], &b = in[2 * half + 1];
        double* to = record + offset + 2 * half;
        store(to, __builtin_shufflevector(low(a), low(b), 0, 2));
        store(to + stride, __builtin_shufflevector(low(a), low(b), 1, 3));
        store(to + 2 * stride, __builtin_shufflevector(high(a), high(b), 0, 2));
        store(to + 3 * stride, __builtin_shufflevector(high(a), high(b), 1, 3));
    }
}

SUNDER_INLINE double sum(Double4 a) {
    const Double2 h = low(a) + high(a);
    return h[0] + h[1];
}

#ifdef __AVX512F__
SUNDER_INLINE double sum(Double8 a) { return sum(low(a) + high(a)); }

SUNDER_INLINE void put_numbers(Double8 a, double* to) { store(to, a); }
SUNDER_INLINE void put_numbers(Double8 a, float* to) { store(to, __builtin_convertvector(a, Float8)); }
#endif

// Four lanes, rounded to what `to` holds.
SUNDER_INLINE void put_numbers(Double4 a, double* to) { store(to, a); }
SUNDER_INLINE void put_numbers(Double4 a, float* to) {
#ifdef __AVX2__
    store(to, __builtin_convertvector(a, Float4));
#else
    const Double2 l = low(a), h = high(a);
    store(to, Float4{static_cast<float>(l[0]), static_cast<float>(l[1]), static_cast<float>(h[0]),
                     static_cast<float>(h[1])});
#endif
}

SUNDER_INLINE Double4 wide(Float4 a) {
#ifdef __AVX2__
    return __builtin_convertvector(a, Double4);
#else
    return {Double2{a[0], a[1]}, Double2{a[2], a[3]}};
#endif
}

// Four numbers of each of four records, wherever they are: out[i] holds number offset + i of each.
SUNDER_INLINE void gather_numbers(const double* const (&records)[4], size_t offset, Double4 (&out)[4]) {
    for (int half = 0; half < 2; ++half) {
        Double2 in[4];
        for (int i = 0; i < 4; ++i) in[i] = load<Double2>(records[i] + offset + 2 * half);
        out[2 * half] = join(__builtin_shufflevector(in[0], in[1], 0, 2), __builtin_shufflevector(in[2], in[3], 0, 2));
        out[2 * half + 1] =
            join(__builtin_shufflevector(in[0], in[1], 1, 3), __builtin_shufflevector(in[2], in[3], 1, 3));
    }
}

// The reverse.
SUNDER_INLINE void scatter_numbers(double* const (&records)[4], size_t offset, const Double4 (&in)[4]) {
    for (int half = 0; half < 2; ++half) {
        const Double4 &a = in[2 * half], &b = in[2 * half + 1];
        const size_t at = offset + 2 * half;
        store(records[0] + at, __builtin_shufflevector(low(a), low(b), 0, 2));
        store(records[1] + at, __builtin_shufflevector(low(a), low(b), 1, 3));
        store(records[2] + at, __builtin_shufflevector(high(a), high(b), 0, 2));
        store(records[3] + at, __builtin_shufflevector(high(a), high(b), 1, 3));
    }
}

SUNDER_INLINE float sum(Float8 a) {
    const Float4 h = low(a) + high(a);
    return (h[0] + h[2]) + (h[1] + h[3]);
}

}  // namespace
}  // namespace sunder
