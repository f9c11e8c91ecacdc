#include "nodes/files/file_io.h"

#include <signal.h>
#include <sys/resource.h>

#include "tests/nodes/temporary_folder.h"

namespace sunder {
namespace {

TEST(FileIo, a_full_disk_leaves_the_old_file_whole_and_no_temporary) {
    TemporaryFolder folder;
    ASSERT_TRUE(write_file(folder / "a.bin", "old"));
    // A file size limit fails a write part of the way as a full disk does, and needs no privileges.
    rlimit old_limit{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
    const auto old_handler = signal(SIGXFSZ, SIG_IGN);
    rlimit limit = old_limit;
    limit.rlim_cur = 4096;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
    const auto written = write_file(folder / "a.bin", std::string(100'000, 'x'));
    setrlimit(RLIMIT_FSIZE, &old_limit);
    signal(SIGXFSZ, old_handler);

    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::io);
    EXPECT_NE(written.error().text().find("a.bin"), std::string::npos);
    EXPECT_EQ(slurp(folder / "a.bin"), "old");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(FileIo, a_link_in_the_temporary_s_place_is_not_followed) {
    TemporaryFolder folder;
    spill(folder / "precious.txt", "precious");
    std::filesystem::create_symlink(folder / "precious.txt", folder / ("a.bin" + std::string(kTemporarySuffix)));
    ASSERT_TRUE(write_file(folder / "a.bin", "new"));
    EXPECT_EQ(slurp(folder / "precious.txt"), "precious");
    EXPECT_EQ(slurp(folder / "a.bin"), "new");
}

TEST(FileIo, a_file_in_a_folder_s_place_is_told) {
    TemporaryFolder folder;
    spill(folder / "file", "");
    const auto written = write_file(folder / "file/a.bin", "x");
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::io);
    const Status made = make_folders(folder / "file/sub");
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::io);
    EXPECT_EQ(slurp(folder / "file"), "");
}

TEST(FileIo, stamps_of_bytes_and_of_the_file_agree) {
    TemporaryFolder folder;
    const std::string bytes(3'000'001, 'q');  // more than one block
    const auto written = write_file(folder / "a.bin", bytes);
    const auto stamp = stamp_of_file(folder / "a.bin");
    ASSERT_TRUE(written && stamp);
    EXPECT_EQ(*written, *stamp);
    EXPECT_EQ(stamp->size, bytes.size());
    EXPECT_NE(stamp_of(bytes.substr(1)).hash, stamp->hash);
}

TEST(FileIo, a_file_written_piece_by_piece_is_whole_or_not_there) {
    TemporaryFolder folder;
    const std::string bytes(1'500'000, 'q');
    {
        auto file = FileWriter::open(folder / "a.bin");
        ASSERT_TRUE(file);
        ASSERT_TRUE(file->append(bytes) && file->append("end"));
        EXPECT_FALSE(std::filesystem::exists(folder / "a.bin"));
        const auto stamp = file->commit();
        ASSERT_TRUE(stamp);
        EXPECT_EQ(*stamp, stamp_of(bytes + "end"));
    }
    {
        auto file = FileWriter::open(folder / "a.bin");
        ASSERT_TRUE(file && file->append("half"));
    }
    EXPECT_EQ(slurp(folder / "a.bin"), bytes + "end");  // never committed: the old one stays
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(FileIo, refuses_what_is_no_plain_file) {
    TemporaryFolder folder;
    EXPECT_EQ(read_file(folder / "missing").error().code, ErrorCode::bad_input);
    EXPECT_EQ(read_file(folder.path()).error().code, ErrorCode::bad_input);
    EXPECT_EQ(read_file("/dev/zero").error().code, ErrorCode::bad_input);  // would never end
    spill(folder / "a", "12345");
    EXPECT_EQ(read_file(folder / "a", 4).error().code, ErrorCode::bad_input);
}

}  // namespace
}  // namespace sunder
