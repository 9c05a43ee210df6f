#pragma once
// SHA-256 of bytes as they come: by which large parts of a model are named, and records of its log chained.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace handloft::model {

class ContentHash {
 public:
  static constexpr std::size_t digest_bytes = 32;
  using Digest = std::array<std::uint8_t, digest_bytes>;

  ContentHash();
  ~ContentHash();
  ContentHash(const ContentHash&) = delete;
  ContentHash& operator=(const ContentHash&) = delete;

  ContentHash& add(std::string_view bytes);
  ContentHash& add(std::uint64_t number);  ///< Eight bytes, little-endian.
  /// Of all that was added; afterwards it is as new.
  Digest finish();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

ContentHash::Digest content_hash(std::string_view bytes);

inline std::string_view as_bytes(const ContentHash::Digest& digest) {
  return {reinterpret_cast<const char*>(digest.data()), digest.size()};
}
/// Lower-case hexadecimal digits, two a byte.
std::string to_hex(std::string_view bytes);

}  // namespace handloft::model
