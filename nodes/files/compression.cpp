#include "nodes/files/compression.h"

#include <zstd.h>

#include <algorithm>
#include <memory>

#include "nodes/files/file_io.h"

namespace sunder {
namespace {

// Level 1 of 22: it keeps up with a disk; level 3 saves 5 % more at less than half the speed (docs/performance.md).
constexpr int kLevel = 1;

Error damaged(const std::string& where, const std::string& what) {
    return bad_input(where, what, "bake again with --restart, or put the file back");
}

}  // namespace

bool is_compressed(std::string_view path) { return path.ends_with(kCompressedSuffix); }

std::string uncompressed_path(const std::string& path) {
    return is_compressed(path) ? path.substr(0, path.size() - kCompressedSuffix.size()) : path;
}

Result<ByteBuffer> compress(std::string_view bytes) {
    const std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
    ByteBuffer out;
    size_t size = 0;
    if (context) {
        ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel);
        ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
        const size_t most = ZSTD_compressBound(bytes.size());
        size = ZSTD_compress2(context.get(), out.grow(most), most, bytes.data(), bytes.size());
        if (!ZSTD_isError(size)) {
            out.shrink(size);
            return out;
        }
    }
    return Error{ErrorCode::internal,
                 std::string("cannot be compressed: ") + (context ? ZSTD_getErrorName(size) : "out of memory"),
                 "frame",
                 "bake without compression",
                 {},
                 {}};
}

// Grows with what really comes out: the size that a damaged file claims is not believed.
Result<std::string> decompress(std::string_view bytes, const std::string& where) {
    const std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
    if (!context) return Error{ErrorCode::internal, "cannot be read: out of memory", where, {}, {}, {}};
    constexpr unsigned kUsualRatio = 8;
    std::string out(std::max(kUsualRatio * bytes.size(), ZSTD_DStreamOutSize()), '\0');
    ZSTD_inBuffer from{bytes.data(), bytes.size(), 0};
    size_t got = 0, left = 1;  // left: 0 when the frame is complete
    while (left > 0) {
        if (got == out.size()) out.resize(2 * out.size());
        ZSTD_outBuffer to{out.data(), out.size(), got};
        left = ZSTD_decompressStream(context.get(), &to, &from);
        if (ZSTD_isError(left)) return damaged(where, std::string("is damaged: ") + ZSTD_getErrorName(left));
        const bool stands_still = to.pos == got && from.pos == from.size;
        got = to.pos;
        if (left > 0 && stands_still && got < out.size()) return damaged(where, "is cut off");
    }
    if (from.pos != from.size) return damaged(where, "has bytes behind its end");
    out.resize(got);
    return out;
}

std::string decompress_head(std::string_view bytes, size_t n) {
    const std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
    std::string head(n, '\0');
    ZSTD_inBuffer from{bytes.data(), bytes.size(), 0};
    ZSTD_outBuffer to{head.data(), head.size(), 0};
    if (!context || ZSTD_isError(ZSTD_decompressStream(context.get(), &to, &from))) return {};
    head.resize(to.pos);
    return head;
}

Result<std::string> read_baked_file(const std::filesystem::path& path) {
    auto bytes = read_file(path);
    if (!bytes || !is_compressed(path.native())) return bytes;
    return decompress(*bytes, path.string());
}

}  // namespace sunder
