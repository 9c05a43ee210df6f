// The key by which a server knows a client again (U1): kept for this user alone, and used by one program at a
// time.

#include "client-hmd/main/client_key.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/support/test_data.h"

namespace handloft::client {
namespace {

namespace fs = std::filesystem;

TEST(ClientKey, IsTheSameNextTimeAndAnotherWhileItIsUsed_U1) {
  const test::TemporaryDirectory folder;
  const Logger log("test");
  std::string first;
  {
    const ClientKey key = ClientKey::open(folder.path().c_str(), nullptr, log);
    first = key.bytes();
    ASSERT_EQ(first.size(), 32U);
    EXPECT_TRUE(ClientKey::open(folder.path().c_str(), nullptr, log).bytes().empty())
        << "two with the same key would end each other's connections";
  }
  EXPECT_EQ(ClientKey::open(folder.path().c_str(), nullptr, log).bytes(), first);
  struct stat about {};
  ASSERT_EQ(::stat((folder.path() / "handloft" / "client_key").c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777U, 0600U);
  const test::TemporaryDirectory other;
  EXPECT_NE(ClientKey::open(nullptr, other.path().c_str(), log).bytes(), first);
  EXPECT_TRUE(fs::exists(other.path() / ".local" / "state" / "handloft" / "client_key"));
}

TEST(ClientKey, IsNotTakenFromWhatOthersMayRead_U2) {
  const test::TemporaryDirectory folder;
  const Logger log("test");
  fs::create_directories(folder.path() / "handloft");
  const fs::path path = folder.path() / "handloft" / "client_key";
  std::ofstream(path) << std::string(32, 'x');
  fs::permissions(path, fs::perms(0644));
  EXPECT_TRUE(ClientKey::open(folder.path().c_str(), nullptr, log).bytes().empty());
  fs::permissions(path, fs::perms(0600));
  EXPECT_EQ(ClientKey::open(folder.path().c_str(), nullptr, log).bytes(), std::string(32, 'x'));
  std::ofstream(path) << "cut off";
  EXPECT_EQ(ClientKey::open(folder.path().c_str(), nullptr, log).bytes().size(), 32U) << "made anew";
  EXPECT_TRUE(ClientKey::open("", "", log).bytes().empty());
  EXPECT_TRUE(ClientKey::open("/proc/nowhere", nullptr, log).bytes().empty());
}

}  // namespace
}  // namespace handloft::client
