#include "server-model/exchange/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "tests/support/test_data.h"

namespace handloft::exchange {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream stream(path);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// No file of this process may grow beyond `bytes` while this lives: write() fails as on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST(AtomicFile, CreatesAndReplaces) {
  const test::TemporaryDirectory folder;
  const fs::path path = folder.path() / "a.txt";
  ASSERT_TRUE(write_file_atomically(path, std::string_view("one")).ok());
  EXPECT_EQ(text_of(path), "one");
  ::chmod(path.c_str(), 0640);
  ASSERT_TRUE(write_file_atomically(path, std::string_view("two")).ok());
  EXPECT_EQ(text_of(path), "two");
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0640U);
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(AtomicFile, FullDiskKeepsTheOldFileAndLeavesNothing) {
  const test::TemporaryDirectory folder;
  const fs::path path = folder.path() / "a.txt";
  ASSERT_TRUE(write_file_atomically(path, std::string_view("old")).ok());
  const std::string large(100'000, 'x');
  Status status;
  {
    const FileSizeLimit limit(4096);
    status = write_file_atomically(path, std::string_view(large));
  }
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::io);
  EXPECT_NE(status.error().message.find(path.string()), std::string::npos) << status.error().message;
  EXPECT_EQ(text_of(path), "old");
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(AtomicFile, AFailingWriterKeepsTheOldFileAndLeavesNothing) {
  const test::TemporaryDirectory folder;
  const fs::path path = folder.path() / "a.txt";
  ASSERT_TRUE(write_file_atomically(path, std::string_view("old")).ok());
  const Status status = write_file_atomically(path, [](const fs::path& temporary) -> Status {
    std::ofstream(temporary) << "half";
    return make_error(ErrorCode::internal, "gave up");
  });
  EXPECT_EQ(status.error().message, "gave up");
  EXPECT_EQ(text_of(path), "old");
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(AtomicFile, MissingFolderAndFolderAsFileAreErrors) {
  const test::TemporaryDirectory folder;
  EXPECT_EQ(write_file_atomically(folder.path() / "no" / "a", std::string_view("x")).error().code,
            ErrorCode::io);
  EXPECT_EQ(write_file_atomically(folder.path(), std::string_view("x")).error().code, ErrorCode::io);
}

TEST(AtomicFile, ADeviceOrAPipeIsNotReplaced) {
  const test::TemporaryDirectory folder;
  const fs::path pipe = folder.path() / "pipe.step";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const Status refused = write_file_atomically(pipe, std::string_view("x"));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::io);
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(AtomicFile, ALinkStaysALink) {
  const test::TemporaryDirectory folder;
  const fs::path path = folder.path() / "a.txt";
  ASSERT_TRUE(write_file_atomically(path, std::string_view("old")).ok());
  fs::create_symlink(path, folder.path() / "link");
  ASSERT_TRUE(write_file_atomically(folder.path() / "link", std::string_view("new")).ok());
  EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
  EXPECT_EQ(text_of(path), "new");
}

}  // namespace
}  // namespace handloft::exchange
