#include "server-model/model/content_hash.h"

#include <openssl/evp.h>

#include <new>

namespace handloft::model {

struct ContentHash::Context {
  EVP_MD_CTX* evp = EVP_MD_CTX_new();
  ~Context() { EVP_MD_CTX_free(evp); }
  Context() {
    // Fetched once: finding the algorithm anew costs more than hashing a small record.
    static const EVP_MD* const sha256 = EVP_MD_fetch(nullptr, "SHA256", nullptr);
    if (evp == nullptr || sha256 == nullptr || EVP_DigestInit_ex2(evp, sha256, nullptr) != 1)
      throw std::bad_alloc();
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
};

ContentHash::ContentHash() : context_(std::make_unique<Context>()) {}
ContentHash::~ContentHash() = default;

ContentHash& ContentHash::add(std::string_view bytes) {
  if (EVP_DigestUpdate(context_->evp, bytes.data(), bytes.size()) != 1) throw std::bad_alloc();
  return *this;
}

ContentHash& ContentHash::add(std::uint64_t number) {
  std::array<char, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>((number >> (8 * i)) & 0xffU);
  return add(std::string_view(bytes.data(), bytes.size()));
}

ContentHash::Digest ContentHash::finish() {
  Digest digest{};
  unsigned size = 0;
  if (EVP_DigestFinal_ex(context_->evp, digest.data(), &size) != 1 || size != digest_bytes ||
      EVP_DigestInit_ex2(context_->evp, nullptr, nullptr) != 1) {
    throw std::bad_alloc();
  }
  return digest;
}

ContentHash::Digest content_hash(std::string_view bytes) {
  return ContentHash().add(bytes).finish();
}

std::string to_hex(std::string_view bytes) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string hex;
  hex.reserve(2 * bytes.size());
  for (const char byte : bytes) {
    const auto value = static_cast<unsigned char>(byte);
    hex.push_back(digits[value >> 4U]);
    hex.push_back(digits[value & 0xfU]);
  }
  return hex;
}

}  // namespace handloft::model
