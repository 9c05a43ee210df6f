// Any bytes as the file of a server's people (F1, U2): it opens or is refused in words, and then is read,
// asked and changed without a crash; nobody gets in with a code that was never given. A first byte that is
// even: the rest is the file. Odd: the rest are changes to a good one, each a three-byte little-endian place
// and a byte.

#include <stdlib.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "common/net/certificates.h"
#include "common/net/pairing_code.h"
#include "server-model/access/access_file.h"

namespace {

using namespace handloft;
using access::AccessFile;
namespace fs = std::filesystem;

constexpr access::Seconds now_s = 1'800'000'000;

void require(bool good) {
  if (!good) std::abort();
}

/// Goes with the program.
class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "handloft-fuzz-XXXXXX").string();
    require(::mkdtemp(pattern.data()) != nullptr);
    path_ = pattern;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  fs::path file() const { return path_ / "server.sqlite"; }
  void clear() const {
    for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(file().string() + suffix);
  }

 private:
  fs::path path_;
};

const Folder& folder() {
  static const Folder one;
  return one;
}

/// Two users, a device, an invitation and an audit trail.
struct Good {
  Good() {
    {
      auto file = AccessFile::open(folder().file(), AccessFile::Mode::create, now_s);
      require(file.ok());
      require(file->set_role("Bob", "*", v1::ROLE_VIEWER, now_s).ok());
      const auto code = file->invite({"Ann", v1::ROLE_EDITOR}, now_s);
      require(code.ok());
      request = *net::make_certificate_request(*net::make_key(), "headset");
      require(file->pair({*code, request, "headset"}, now_s).ok());
      const auto open = file->invite({"Cy", v1::ROLE_EDITOR}, now_s);
      require(open.ok());
      auto never_given = *net::read_pairing_code(*open);
      never_given.secret ^= 1;
      wrong = net::write_pairing_code(never_given);
    }
    std::ifstream in(folder().file(), std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
    folder().clear();
  }
  std::string bytes, request, wrong;
};

const Good& good() {
  static const Good one;
  return one;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  std::string bytes;
  if (data[0] % 2 == 0) {
    bytes.assign(reinterpret_cast<const char*>(data + 1), size - 1);
  } else {
    bytes = good().bytes;
    constexpr std::size_t change = 4;
    for (std::size_t at = 1; at + change <= size; at += change) {
      const std::size_t place = data[at] | std::size_t{data[at + 1]} << 8U | std::size_t{data[at + 2]} << 16U;
      bytes[place % bytes.size()] = static_cast<char>(data[at + 3]);
    }
  }
  folder().clear();
  std::ofstream(folder().file(), std::ios::binary) << bytes;
  fs::permissions(folder().file(), fs::perms::owner_read | fs::perms::owner_write);
  auto file = AccessFile::open(folder().file(), AccessFile::Mode::existing, now_s);
  if (!file) {
    require(!file.error().message.empty());
    return 0;
  }
  if (const auto everybody = file->read()) {
    for (const access::Device& device : everybody->devices)
      (void)file->revoke_device(device.fingerprint, now_s);
  }
  constexpr std::uint32_t entries = 100;
  if (const auto trail = file->audit(entries)) require(trail->size() <= entries);
  (void)file->touched();
  require(!file->pair({good().wrong, good().request, "headset"}, now_s));
  (void)file->invite({"Dan", v1::ROLE_COMMENTER}, now_s);
  (void)file->set_role("Ann", "seat", v1::ROLE_VIEWER, now_s);
  (void)file->revoke_user("Bob", now_s);
  (void)file->read();
  return 0;
}
