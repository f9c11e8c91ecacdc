#include "nodes/files/content_key.h"

#include <xxhash.h>

#include <cstdio>

namespace sunder {

struct KeyHasher::State {
    XXH3_state_t* xxh = XXH3_createState();
    ~State() { XXH3_freeState(xxh); }
};

KeyHasher::KeyHasher() : state_(std::make_unique<State>()) { XXH3_64bits_reset(state_->xxh); }
KeyHasher::~KeyHasher() = default;

KeyHasher& KeyHasher::add_integer(uint64_t value) {
    XXH3_64bits_update(state_->xxh, &value, sizeof value);
    return *this;
}

KeyHasher& KeyHasher::add(double value) {
    XXH3_64bits_update(state_->xxh, &value, sizeof value);
    return *this;
}

KeyHasher& KeyHasher::add(std::string_view text) {
    add(text.size());
    XXH3_64bits_update(state_->xxh, text.data(), text.size());
    return *this;
}

KeyHasher& KeyHasher::add(const Vec3& v) { return add(v.x()).add(v.y()).add(v.z()); }
KeyHasher& KeyHasher::add(const Quat& q) { return add(q.w()).add(q.x()).add(q.y()).add(q.z()); }
KeyHasher& KeyHasher::add(const Pose& p) { return add(p.position).add(p.orientation); }
ContentKey KeyHasher::key() const { return XXH3_64bits_digest(state_->xxh); }

std::string to_text(ContentKey key) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(key));
    return text;
}

}  // namespace sunder
