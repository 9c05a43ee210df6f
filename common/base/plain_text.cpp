#include "common/base/plain_text.h"

namespace handloft {

std::string plain_text(std::string_view text, std::size_t most) {
  constexpr unsigned char continuation_bits = 0xC0U, continuation = 0x80U;
  std::size_t end = most;
  const auto is_within_character = [&] {
    return (static_cast<unsigned char>(text[end]) & continuation_bits) == continuation;
  };
  if (end < text.size()) {
    while (end > 0 && is_within_character()) --end;
  }
  std::string words(text.substr(0, end));
  for (char& c : words) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  }
  return words;
}

}  // namespace handloft
