#pragma once
// Glyphs in one picture, drawn by FreeType from the font that fontconfig names. For the HUD, the table's
// labels and their signs. Pure CPU: no OpenGL here.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace handloft::client {

struct Glyph {
  int x = 0, y = 0, width = 0, height = 0;  ///< In the atlas, pixels.
  float left = 0.0F, top = 0.0F;            ///< From the pen to the bitmap's top left corner, y up.
  float advance = 0.0F;
};

class FontAtlas {
 public:
  /// `pixel_height`: of the em; `more`: UTF-8, characters beside Latin letters and the HUD's signs. Errors:
  /// not_found when no font is installed, naming a package; io when FreeType cannot read it.
  static Result<FontAtlas> load(std::string_view family, int pixel_height, std::string_view more = {});

  int width() const { return width_; }
  int height() const { return height_; }
  int pixel_height() const { return pixel_height_; }
  const std::vector<std::uint8_t>& coverage() const { return coverage_; }  ///< width * height, 255: ink.
  bool has(char32_t character) const { return glyphs_.count(character) != 0; }
  /// A character that the font lacks is shown as '?'.
  const Glyph& glyph(char32_t character) const;
  /// Width of a line in units of the atlas's em (multiply by the height in pixels).
  float measure(std::string_view utf8) const;

 private:
  std::map<char32_t, Glyph> glyphs_;
  std::vector<std::uint8_t> coverage_;
  int width_ = 0;
  int height_ = 0;
  int pixel_height_ = 1;
};

/// Path of the file that fontconfig names for "DejaVu Sans" or "DejaVu Sans:bold"; empty: none.
std::string find_font_file(std::string_view family);

/// Characters of a UTF-8 text; malformed bytes become U+FFFD, never more than there are bytes.
std::u32string decode_utf8(std::string_view text);

}  // namespace handloft::client
