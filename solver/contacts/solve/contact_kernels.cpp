// Compiled once for each instruction set (lanes.h).
#define SUNDER_LANES Float8

#include "solver/contacts/solve/contact_kernels.h"

#include <type_traits>

#include "solver/contacts/solve/contact_sides.h"

namespace sunder {
namespace {

static_assert(kLanes == kContactLanes);

// No eigenvalue of the symmetric, positive matrix is larger, and this one by little where they are alike.
template <class L>
SUNDER_INLINE L largest_eigenvalue_bound(const SymmetricOf<L>& m) {
    const auto one = all<L>(1), two = all<L>(2);
    const L mean = (m.xx + m.yy + m.zz) / all<L>(3), scale = one / larger(mean, all<L>(kTiny));
    const L x = scale * m.xx - one, y = scale * m.yy - one, z = scale * m.zz - one;
    const L xy = scale * m.xy, xz = scale * m.xz, yz = scale * m.yz;
    const L squared = x * x + y * y + z * z + two * (xy * xy + xz * xz + yz * yz);
    return mean * (one + two * root(squared / all<L>(6)));
}

template <class L>
SUNDER_INLINE void take_up(const ContactArrays& arrays, size_t k) {
    constexpr size_t kStride = sizeof(RoundContact) / sizeof(float), kRows = kStride / 4;
    L row[kRows][4];
    for (size_t i = 0; i < kRows; ++i)
        gather4<kStride>(arrays.contacts->normal, arrays.contact_of_lane + kLanes * k, 4 * i, row[i]);
    const auto vector = [&](size_t i) { return VectorOf<L>{row[i][0], row[i][1], row[i][2]}; };
    ContactBatch& c = arrays.batches[k];
    store3(c.normal, vector(0)), store3(c.arm[0], vector(1)), store3(c.arm[1], vector(2));
    store(arrays.starts[k].missing, row[0][3]), store3(arrays.starts[k].motion, vector(3));
    store(c.friction, row[1][3]), store(c.rolling_arm, row[2][3]), store(c.inverse_mass, row[3][3]);
    store(c.normal_impulse, row[4][3]);
    for (size_t i = 0; i < 3; ++i) store(c.impulse[i], row[4][i]), store(c.impulse[3 + i], row[5][i]);
    for (size_t which = 0; which < 2; ++which)
        store(c.movable[which], row[6][which]), store(c.piece[which], row[6][2 + which]);
}

template <class S>
SUNDER_INLINE void describe_batch(const ContactArrays& arrays, size_t k) {
    using L = typename S::Width;
    using V = VectorOf<L>;
    take_up<L>(arrays, k);
    ContactBatch& c = arrays.batches[k];
    const S a = side_of<S>(arrays, c, 0), b = side_of<S>(arrays, c, 1);
    const auto response = [&](V f) { return displacement(a, by_push(a, f)) + displacement(b, by_push(b, f)); };
    const auto zero = all<L>(0), one = all<L>(1), tiny = all<L>(kTiny);
    const V n = load3<L>(c.normal);
    const V along = response(n);
    store3(c.along_normal, along);
    const L let = load<L>(c.inverse_mass), inverse_mass = let * dot(n, along);
    const Mask<L> counts = inverse_mass > zero;
    store(c.inverse_mass, select<L>(counts, inverse_mass, zero));
    store(c.mass, select<L>(counts, one / larger(inverse_mass, tiny), zero));

    // The larger eigenvalue of the response to tangents.
    const auto [t, u] = tangents_of(n);
    const V along_t = response(t);
    const L tt = dot(t, along_t), tu = dot(u, along_t), uu = dot(u, response(u));
    const auto one_half = all<L>(0.5);
    const L half = one_half * (tt + uu), apart = one_half * (tt - uu);
    const L slip = half + root(apart * apart + tu * tu);
    store(c.slip_mass, select<L>(counts, one / larger(slip, tiny), zero));

    const SymmetricOf<L> turning = {a.J.xx + b.J.xx, a.J.yy + b.J.yy, a.J.zz + b.J.zz,
                                    a.J.xy + b.J.xy, a.J.xz + b.J.xz, a.J.yz + b.J.yz};
    const L arm = load<L>(c.rolling_arm);
    const Mask<L> rolls = counts & (arm > zero);
    const L inertia = one / larger(largest_eigenvalue_bound(turning), tiny);
    store(c.rolling_inertia, select<L>(rolls, inertia, zero));
    store(c.rolling_weight, select<L>(rolls, one / larger(arm * arm, tiny), zero));
}

template <class L>
struct Began {
    Double4 shift[kWidth<L> / 4][3];  // of four lanes each, l
    VectorOf<L> turned;               // rad
};

template <class L>
SUNDER_INLINE Began<L> began_of(const ContactArrays& arrays, const uint32_t* movable) {
    constexpr size_t kNumbers = sizeof(RoundBegan) / sizeof(double) / kMovableStride;  // for one of a movable
    Began<L> s;
    for (size_t four = 0; four < kWidth<L> / 4; ++four) {
        Double4 shift[4];
        gather4<kNumbers>(arrays.began->shift, movable + 4 * four, 0, shift);
        for (int i = 0; i < 3; ++i) s.shift[four][i] = shift[i];
    }
    L turned[4];
    gather4<2 * kNumbers>(arrays.began->turned, movable, 0, turned);
    s.turned = {turned[0], turned[1], turned[2]};
    return s;
}

template <class L>
SUNDER_INLINE bool is_zero(const ContactBatch& c) {
    L sum = absolute(load<L>(c.normal_impulse)) + absolute(load<L>(c.normal_change)) +
            absolute(load<L>(c.normal_direction));
    for (int k = 0; k < 6; ++k)
        sum =
            sum + absolute(load<L>(c.impulse[k])) + absolute(load<L>(c.change[k])) + absolute(load<L>(c.direction[k]));
    return !any(sum > all<L>(0));
}

template <class L>
SUNDER_INLINE void start_batch(const ContactArrays& arrays, size_t k) {
    using V = VectorOf<L>;
    ContactBatch& c = arrays.batches[k];
    const BatchStart& from = arrays.starts[k];
    const Began<L> a = began_of<L>(arrays, c.movable[0]), b = began_of<L>(arrays, c.movable[1]);
    const auto apart = [&](int i) {
        float shift[kWidth<L>];
        for (size_t four = 0; four < kWidth<L> / 4; ++four)
            put_numbers(a.shift[four][i] - b.shift[four][i], shift + 4 * four);
        return load<L>(shift);
    };
    const V motion = load3<L>(from.motion) + V{apart(0), apart(1), apart(2)} + cross(a.turned, load3<L>(c.arm[0])) -
                     cross(b.turned, load3<L>(c.arm[1]));
    store3(c.motion, motion);
    store3(c.rolled, a.turned - b.turned);
    store(c.missing, load<L>(from.missing) - dot(load3<L>(c.normal), motion));
    const auto zero = all<L>(0);
    store(c.normal_change, zero), store(c.normal_direction, zero);
    for (int i = 0; i < 6; ++i) store(c.change[i], zero), store(c.direction[i], zero);
    arrays.idle[k] = is_zero<L>(c);
}

template <class S>
SUNDER_INLINE void give_batch(const ContactArrays& arrays, size_t k) {
    using L = typename S::Width;
    const ContactBatch& c = arrays.batches[k];
    const VectorOf<L> friction = {load<L>(c.impulse[0]), load<L>(c.impulse[1]), load<L>(c.impulse[2])};
    const VectorOf<L> rolling = {load<L>(c.impulse[3]), load<L>(c.impulse[4]), load<L>(c.impulse[5])};
    const VectorOf<L> impulse = load<L>(c.normal_impulse) * load3<L>(c.normal) + friction;
    for (int which = 0; which < 2; ++which) {
        const S s = side_of<S>(arrays, c, which);
        auto by = by_push(s, which == 0 ? impulse : -impulse);
        turn_by(s, which == 0 ? rolling : -rolling, by);
        add(arrays, c, which, by);
    }
}

// What the last pass changed, lane by lane.
class LaneResult {
public:
    SUNDER_INLINE void take(Lanes change, Lanes size) { largest_ = larger(largest_, change), size_ = size_ + size; }
    SUNDER_INLINE void take(Single change, Single size) { take(Narrow{change}, Narrow{size}); }
    SUNDER_INLINE void take(Narrow change, Narrow size) {  // other lanes are none
        largest_ = join(larger(low(largest_), change), high(largest_));
        size_ = join(low(size_) + size, high(size_));
    }
    SUNDER_INLINE PassResult all() const {
        float largest[kLanes];
        store(largest, largest_);
        PassResult result{0, sum(size_)};
        for (float x : largest) result.largest = x > result.largest ? x : result.largest;
        return result;
    }

private:
    Lanes largest_ = sunder::all(0), size_ = sunder::all(0);
};

// A pass is a step down the gradient; as much of the last direction is added to it as the steps' shrinking allows.
template <class V>
struct Follower {
    V share, keeps;  // keeps: 1 or 0

    explicit SUNDER_INLINE Follower(Following f) {
        float shares[kLanes], keep[kLanes];
        for (size_t i = 0; i < kLanes; ++i) shares[i] = static_cast<float>(f.share), keep[i] = f.keeps ? 1 : 0;
        share = load<V>(shares), keeps = load<V>(keep);
    }
    SUNDER_INLINE V operator()(V value, V change, float* io_direction) const {
        const V along = share * load<V>(io_direction);
        store(io_direction, keeps * (change + along));
        return value + along;
    }
    SUNDER_INLINE V operator()(const float* value, const float* change, float* io_direction) const {
        return (*this)(load<V>(value), load<V>(change), io_direction);
    }
};

// Not beyond length `limit`; of a limit of zero nothing is left, however small its square is.
template <class L>
SUNDER_INLINE VectorOf<L> within(VectorOf<L> v, L limit) {
    const L squared = dot(v, v);
    return select<L>(squared < limit * limit, all<L>(1), limit / root(larger(squared, all<L>(kTiny)))) * v;
}

template <class S>
SUNDER_INLINE void visit(const ContactArrays& arrays, uint32_t batch, const Follower<typename S::Width>& follow,
                         LaneResult& io) {
    using L = typename S::Width;
    using V = VectorOf<L>;
    ContactBatch& c = arrays.batches[batch];
    const S a = side_of<S>(arrays, c, 0), b = side_of<S>(arrays, c, 1);
    const V n = load3<L>(c.normal), moved_by = moved(a) - moved(b);
    const L missing = load<L>(c.missing) - dot(n, moved_by);
    const auto zero = all<L>(0);
    if (arrays.idle[batch] && !any(missing > zero)) return;

    const L before = follow(c.normal_impulse, c.normal_change, c.normal_direction);
    L was[6];
    for (int k = 0; k < 6; ++k) was[k] = follow(c.impulse[k], c.change[k], c.direction[k]);
    const V friction(was[0], was[1], was[2]), rolling(was[3], was[4], was[5]);

    const L normal = larger(before + missing * load<L>(c.mass), zero), change = normal - before;
    const V slip = load3<L>(c.motion) + moved_by + change * load3<L>(c.along_normal);
    const V wanted = friction - load<L>(c.slip_mass) * (slip - dot(n, slip) * n);
    const V new_friction = within<L>(wanted, load<L>(c.friction) * normal);
    const V friction_change = new_friction - friction;
    const V impulse = change * n + friction_change;
    auto by_a = by_push(a, impulse), by_b = by_push(b, -impulse);

    const V rolled = load3<L>(c.rolled) + (a.spin + by_a.spin) - (b.spin + by_b.spin);
    const V resisted = rolling - load<L>(c.rolling_inertia) * rolled;
    const V new_rolling = within<L>(resisted, load<L>(c.rolling_arm) * normal);
    const V rolling_change = new_rolling - rolling;
    turn_by(a, rolling_change, by_a);
    turn_by(b, -rolling_change, by_b);
    add(arrays, c, 0, by_a);
    add(arrays, c, 1, by_b);

    store(c.normal_impulse, normal), store(c.normal_change, change);
    store3(c.impulse, new_friction), store3(c.impulse + 3, new_rolling);
    store3(c.change, friction_change), store3(c.change + 3, rolling_change);
    arrays.idle[batch] = !any(normal > zero) && is_zero<L>(c);

    const L inverse_mass = load<L>(c.inverse_mass);
    const L squared = change * change + dot(friction_change, friction_change) +
                      load<L>(c.rolling_weight) * dot(rolling_change, rolling_change);
    io.take(absolute(change) * inverse_mass, inverse_mass * squared);
}

// Calls body(std::type_identity<S>), S: the kind of side that suits the form, of four lanes at least.
template <class Body>
SUNDER_INLINE void with_sides_of(BatchForm form, const Body& body) {
    if (form.width < kLanes)
        form.rigid ? body(std::type_identity<RigidSide<Narrow>>()) : body(std::type_identity<Side<Narrow>>());
    else
        form.rigid ? body(std::type_identity<RigidSide<Lanes>>()) : body(std::type_identity<Side<Lanes>>());
}
// Of one lane as well.
template <class Body>
SUNDER_INLINE void with_least_sides_of(BatchForm form, const Body& body) {
    if (form.width > 1)
        with_sides_of(form, body);
    else
        form.rigid ? body(std::type_identity<RigidSide<Single>>()) : body(std::type_identity<Side<Single>>());
}

void describe(const ContactArrays& arrays, size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k)
        with_sides_of(arrays.form[k], [&]<class S>(std::type_identity<S>) { describe_batch<S>(arrays, k); });
}

void start(const ContactArrays& arrays, size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k)
        arrays.form[k].width < kLanes ? start_batch<Narrow>(arrays, k) : start_batch<Lanes>(arrays, k);
}

void give(const ContactArrays& arrays, size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k)
        if (!arrays.idle[k])
            with_sides_of(arrays.form[k], [&]<class S>(std::type_identity<S>) { give_batch<S>(arrays, k); });
}

PassResult pass(const ContactArrays& arrays, const uint32_t* batches, size_t n, Following following) {
    const Follower<Lanes> follow(following);
    const Follower<Narrow> follow_narrow(following);
    const Follower<Single> follow_single(following);
    LaneResult lanes;
    for (size_t k = 0; k < n; ++k)
        with_least_sides_of(arrays.form[batches[k]], [&]<class S>(std::type_identity<S>) {
            if constexpr (std::is_same_v<typename S::Width, Single>)
                visit<S>(arrays, batches[k], follow_single, lanes);
            else if constexpr (std::is_same_v<typename S::Width, Narrow>)
                visit<S>(arrays, batches[k], follow_narrow, lanes);
            else
                visit<S>(arrays, batches[k], follow, lanes);
        });
    return lanes.all();
}

template <size_t numbers, size_t stride>
SUNDER_INLINE void follow_records(float* records, float* before, float* direction, size_t n, Following following) {
    const Follower<Float4> follow(following);
    for (size_t k = 0; k < n; ++k)
        for (size_t i = 0; i < numbers; i += 4) {
            float* at = records + stride * k + i;
            float* was = before + numbers * k + i;
            const Float4 value = load<Float4>(at);
            const Float4 now = follow(value, value - load<Float4>(was), direction + numbers * k + i);
            store(at, now), store(was, now);
        }
}

// The fourth number of each four says how pushes divide: it never changes, and nothing is followed.
void follow_movables(RoundMovable* m, float* before, float* direction, size_t n, Following following) {
    follow_records<kMovedNumbers, kMovableStride>(m->moved, before, direction, n, following);
}
void follow_pieces(RoundPiece* p, float* before, float* direction, size_t n, Following following) {
    follow_records<kPieceMovedNumbers, kPieceStride>(p->shift, before, direction, n, following);
}
void follow_rigid(RoundPiece* p, float* before, float* direction, size_t n, Following following) {
    follow_records<kRigidMovedNumbers, kPieceStride>(p->spin, before, direction, n, following);
}

}  // namespace

const ContactKernels SUNDER_KERNELS(kContactKernels) = {describe,        start,         give,        pass,
                                                        follow_movables, follow_pieces, follow_rigid};

}  // namespace sunder
