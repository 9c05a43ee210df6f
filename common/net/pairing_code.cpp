#include "common/net/pairing_code.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

namespace handloft::net {

namespace {

constexpr std::string_view signs = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";
constexpr std::string_view hex_digits = "0123456789abcdef";
constexpr std::size_t sign_bits = 5;
constexpr std::size_t group_signs = 5;
constexpr std::size_t data_signs = 38;  // 2 bits of version, all 0, 128 of the authority, 60 secret ones.
constexpr std::size_t check_signs = 2;
constexpr std::size_t code_signs = data_signs + check_signs;
constexpr std::size_t version_bits = 2;
constexpr std::size_t secret_bits = 60;
constexpr std::size_t hex_bits = 4;

using Signs = std::array<std::uint8_t, code_signs>;

std::uint32_t crc10(const Signs& all) {
  constexpr std::uint32_t polynomial = 0x233, top = 1U << 9U, mask = 0x3FF;
  std::uint32_t crc = 0;
  for (std::size_t i = 0; i < data_signs; ++i) {
    for (std::size_t bit = sign_bits; bit-- > 0;) {
      const bool out = ((crc & top) != 0) != (((all.at(i) >> bit) & 1U) != 0);
      crc = (crc << 1U) & mask;
      if (out) crc ^= polynomial;
    }
  }
  return crc;
}

bool bit_of(const Signs& all, std::size_t place) {
  return ((all.at(place / sign_bits) >> (sign_bits - 1 - place % sign_bits)) & 1U) != 0;
}

void set_bit(Signs& all, std::size_t place) {
  all.at(place / sign_bits) =
      static_cast<std::uint8_t>(all.at(place / sign_bits) | 1U << (sign_bits - 1 - place % sign_bits));
}

std::optional<std::uint8_t> value_of(char sign) {
  if (sign >= 'a' && sign <= 'z') sign = static_cast<char>(sign - 'a' + 'A');
  if (sign == 'O') sign = '0';
  if (sign == 'I' || sign == 'L') sign = '1';
  const std::size_t place = signs.find(sign);
  return place == std::string_view::npos ? std::nullopt : std::optional(static_cast<std::uint8_t>(place));
}

Error bad_code(std::string message) {
  return make_error(ErrorCode::invalid_argument, std::move(message), "code");
}

}  // namespace

std::string write_pairing_code(const PairingCode& code) {
  Signs all{};
  std::size_t place = version_bits;
  for (std::size_t digit = 0; digit < pairing_authority_digits; ++digit) {
    const std::size_t value = digit < code.authority.size() ? hex_digits.find(code.authority[digit]) : 0;
    for (std::size_t bit = hex_bits; bit-- > 0; ++place) {
      if (((value >> bit) & 1U) != 0) set_bit(all, place);
    }
  }
  for (std::size_t bit = secret_bits; bit-- > 0; ++place) {
    if (((code.secret >> bit) & 1U) != 0) set_bit(all, place);
  }
  const std::uint32_t crc = crc10(all);
  all[data_signs] = static_cast<std::uint8_t>(crc >> sign_bits);
  all[data_signs + 1] = static_cast<std::uint8_t>(crc & 0x1FU);
  std::string text;
  for (std::size_t i = 0; i < code_signs; ++i) {
    if (i > 0 && i % group_signs == 0) text += '-';
    text += signs[all.at(i)];
  }
  return text;
}

Result<PairingCode> read_pairing_code(std::string_view text) {
  Signs all{};
  std::size_t count = 0;
  for (const char sign : text) {
    if (sign == '-' || sign == ' ' || sign == '\t' || sign == '\n' || sign == '\r') continue;
    const auto value = value_of(sign);
    if (!value) return bad_code("found a sign that no code has, expected digits, letters and hyphens");
    if (count < code_signs) all.at(count) = *value;
    ++count;
  }
  if (count != code_signs)
    return bad_code(
        fmt::format("found {} signs, expected {} in groups of {}", count, code_signs, group_signs));
  const std::uint32_t crc = crc10(all);
  if (all[data_signs] != crc >> sign_bits || all[data_signs + 1] != (crc & 0x1FU))
    return bad_code("the code is mistyped: its last two signs do not fit the others");
  if (bit_of(all, 0) || bit_of(all, 1))
    return bad_code("the code is of a later kind than this program knows");
  PairingCode code;
  std::size_t place = version_bits;
  for (std::size_t digit = 0; digit < pairing_authority_digits; ++digit) {
    std::size_t value = 0;
    for (std::size_t bit = 0; bit < hex_bits; ++bit, ++place)
      value = value * 2 + (bit_of(all, place) ? 1 : 0);
    code.authority += hex_digits[value];
  }
  for (std::size_t bit = 0; bit < secret_bits; ++bit, ++place)
    code.secret = code.secret * 2 + (bit_of(all, place) ? 1 : 0);
  return code;
}

}  // namespace handloft::net
