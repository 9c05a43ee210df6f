#pragma once
// The bytes of a recording (layout in recording.h), shared by its writer and its reader.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace handloft::record {

inline constexpr std::array<std::uint8_t, 8> recording_magic{'H', 'L', 'R', 'E', 'C', 1, '\r', '\n'};
inline constexpr std::size_t magic_version_byte = 5;
inline constexpr std::size_t record_header_bytes = 24;
inline constexpr std::size_t payload_crc_offset = 16;
inline constexpr std::size_t header_crc_offset = 20;

template <typename Whole>
void store_little(std::uint8_t* out, Whole value) {
  for (std::size_t i = 0; i < sizeof(Whole); ++i) {
    out[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
  }
}

template <typename Whole>
Whole load_little(const std::uint8_t* in) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Whole); ++i) value |= static_cast<std::uint64_t>(in[i]) << (8 * i);
  return static_cast<Whole>(value);
}

}  // namespace handloft::record
