#include "server-model/access/names.h"

#include <fmt/format.h>

#include <algorithm>

#include "server-model/access/roles.h"

namespace handloft::access {

namespace {

constexpr std::size_t longest_name = 64;

bool is_control(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

/// The bytes of the UTF-8 sequence at the beginning; 0: none begins there.
std::size_t sequence(std::string_view text) {
  const auto at = [&](std::size_t place) {
    return place < text.size() ? static_cast<unsigned char>(text[place]) : 0U;
  };
  const unsigned first = at(0);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  for (std::size_t place = 1; place < length; ++place) {
    if ((at(place) & 0xC0U) != 0x80) return 0;
  }
  if (first == 0xE0 && at(1) < 0xA0) return 0;   // overlong
  if (first == 0xED && at(1) >= 0xA0) return 0;  // surrogates
  if (first == 0xF0 && at(1) < 0x90) return 0;
  if (first == 0xF4 && at(1) >= 0x90) return 0;
  return length;
}

}  // namespace

Status check_name(std::string_view name, std::string_view field) {
  if (name.empty() || name.size() > longest_name || name == every_model ||
      std::any_of(name.begin(), name.end(), is_control) || plain(name) != name)
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found \"{}\", expected a name of 1 to {} bytes", plain(name), longest_name),
        std::string(field));
  return {};
}

Status check_model_name(std::string_view name, std::string_view field) {
  const bool good = !name.empty() && name.size() <= longest_name && is_letter_or_digit(name.front()) &&
                    std::all_of(name.begin(), name.end(), [](char c) {
                      return is_letter_or_digit(c) || c == '-' || c == '_' || c == '.';
                    });
  if (good) return {};
  return make_error(
      ErrorCode::invalid_argument,
      fmt::format("found \"{}\" of {} bytes, expected 1 to {} letters, digits, '-', '_' and '.', "
                  "the first one a letter or digit",
                  plain(name), name.size(), longest_name),
      std::string(field));
}

Status check_model(std::string_view model) {
  return model == every_model ? Status() : check_model_name(model, "model");
}

std::string plain(std::string_view text, std::size_t most) {
  std::string words;
  while (!text.empty()) {
    const std::size_t length = sequence(text);
    const std::size_t taken = std::max<std::size_t>(length, 1);
    if (words.size() + taken > most) break;
    // The C1 controls are two bytes: 0xC2 0x80..0x9F.
    const bool second_controls =
        length == 2 && text[0] == '\xC2' && static_cast<unsigned char>(text[1]) < 0xA0;
    if (length == 0) {
      words += '?';
    } else if (is_control(text[0]) || second_controls) {
      words += ' ';
    } else {
      words += text.substr(0, length);
    }
    text.remove_prefix(taken);
  }
  return words;
}

}  // namespace handloft::access
