#include "daemon-tracking/source/glove/serial_glove_line.h"

#include <fmt/format.h>

#include <string_view>

namespace handloft::tracking {
namespace {

constexpr std::string_view button_letters = "HIJKLMNO";  // In the order of SerialGloveButton.

bool is_digit(std::uint8_t byte) {
  return byte >= '0' && byte <= '9';
}

Error corrupt(const char* what, std::string field) {
  return make_error(ErrorCode::data_corrupt, what, std::move(field));
}

std::string letter(std::uint8_t byte) {
  return byte >= 0x21 && byte < 0x7F ? std::string(1, static_cast<char>(byte))
                                     : fmt::format("\\x{:02x}", byte);
}

// The digits from `at` on, at least one; moves `at` behind them.
Result<std::uint16_t> read_number(std::span<const std::uint8_t> line, std::size_t& at,
                                  const std::string& field) {
  if (at >= line.size() || !is_digit(line[at])) return corrupt("no number follows", field);
  std::uint32_t value = 0;
  for (; at < line.size() && is_digit(line[at]); ++at) {
    value = value * 10 + (line[at] - std::uint32_t{'0'});
    if (value > serial_glove_largest) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found more than {}, the largest value of any converter", serial_glove_largest), field);
    }
  }
  return static_cast<std::uint16_t>(value);
}

// "(AB)512": checked for its form; a finger's single joints and splay decide nothing.
Status skip_joint(std::span<const std::uint8_t> line, std::size_t& at) {
  const std::size_t begin = at++;
  while (at < line.size() && line[at] >= 'A' && line[at] <= 'Z' && at - begin <= 3) ++at;
  if (at >= line.size() || line[at] != ')' || at - begin < 3)
    return corrupt("no joint's name in brackets", "(");
  ++at;
  if (auto number = read_number(line, at, "()"); !number) return number.error();
  return {};
}

Status set_once(std::optional<std::uint16_t>& slot, std::span<const std::uint8_t> line, std::size_t& at,
                const std::string& field) {
  auto number = read_number(line, at, field);
  if (!number) return number.error();
  if (slot) return corrupt("found twice", field);
  slot = *number;
  return {};
}

}  // namespace

Result<SerialGloveLine> parse_serial_glove_line(std::span<const std::uint8_t> line) {
  if (!line.empty() && line.back() == '\r') line = line.first(line.size() - 1);
  if (line.empty()) return corrupt("found no bytes", "line");
  if (line.size() > max_serial_glove_line) return corrupt("longer than any glove's", "line");
  SerialGloveLine out;
  std::size_t at = 0;
  while (at < line.size()) {
    const std::uint8_t byte = line[at];
    if (byte == '(') {
      if (Status status = skip_joint(line, at); !status) return status.error();
      continue;
    }
    ++at;
    const std::string field = letter(byte);
    Status status;
    const auto button = button_letters.find(static_cast<char>(byte));
    if (byte >= 'A' && byte <= 'E') {
      status = set_once(out.curl[static_cast<std::size_t>(byte - 'A')], line, at, field);
    } else if (byte == 'F') {
      status = set_once(out.joystick_x, line, at, field);
    } else if (byte == 'G') {
      status = set_once(out.joystick_y, line, at, field);
    } else if (byte == 'P') {
      status = set_once(out.trigger, line, at, field);
    } else if (button != std::string_view::npos) {
      const auto bit = static_cast<std::uint16_t>(1u << button);
      if ((out.buttons & bit) != 0) status = corrupt("found twice", field);
      out.buttons = static_cast<std::uint16_t>(out.buttons | bit);
    } else {
      status = corrupt("an unknown letter", field);
    }
    if (!status) return status.error();
  }
  return out;
}

std::string encode_serial_glove_line(const SerialGloveLine& line) {
  std::string out;
  for (std::size_t i = 0; i < line.curl.size(); ++i) {
    if (line.curl[i]) out += fmt::format("{}{}", static_cast<char>('A' + static_cast<int>(i)), *line.curl[i]);
  }
  if (line.joystick_x) out += fmt::format("F{}", *line.joystick_x);
  if (line.joystick_y) out += fmt::format("G{}", *line.joystick_y);
  for (std::size_t i = 0; i < button_letters.size(); ++i) {
    if ((line.buttons >> i & 1u) != 0) out += button_letters[i];
  }
  if (line.trigger) out += fmt::format("P{}", *line.trigger);
  return out;
}

}  // namespace handloft::tracking
