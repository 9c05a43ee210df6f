#include "client-hmd/render/font_atlas.h"

#include <fmt/format.h>
#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <memory>

namespace handloft::client {
namespace {

constexpr int atlas_width_px = 1024;
constexpr int padding_px = 4;  ///< Enough that mipmaps of a label do not bleed into the neighbour.
constexpr std::u32string_view signs = U"·•●○–—−±²°µ×↶↷◐◠✚∴⌖⇄⚠…";

}  // namespace

std::string find_font_file(std::string_view family) {
  const std::unique_ptr<FcConfig, decltype(&FcConfigDestroy)> config(FcInitLoadConfigAndFonts(),
                                                                     FcConfigDestroy);
  if (config == nullptr) return {};
  const std::string name(family);
  const std::unique_ptr<FcPattern, decltype(&FcPatternDestroy)> pattern(
      FcNameParse(reinterpret_cast<const FcChar8*>(name.c_str())), FcPatternDestroy);
  if (pattern == nullptr) return {};
  FcConfigSubstitute(config.get(), pattern.get(), FcMatchPattern);
  FcDefaultSubstitute(pattern.get());
  FcResult outcome = FcResultNoMatch;
  const std::unique_ptr<FcPattern, decltype(&FcPatternDestroy)> match(
      FcFontMatch(config.get(), pattern.get(), &outcome), FcPatternDestroy);
  FcChar8* file = nullptr;
  if (match == nullptr || FcPatternGetString(match.get(), FC_FILE, 0, &file) != FcResultMatch) return {};
  return reinterpret_cast<const char*>(file);
}

std::u32string decode_utf8(std::string_view text) {
  std::u32string out;
  std::size_t i = 0;
  while (i < text.size()) {
    const auto lead = static_cast<unsigned char>(text[i]);
    std::size_t length = 1;
    char32_t value = lead;
    if (lead >= 0xF0 && lead < 0xF8) {
      length = 4;
      value = lead & 0x07U;
    } else if (lead >= 0xE0 && lead < 0xF0) {
      length = 3;
      value = lead & 0x0FU;
    } else if (lead >= 0xC0 && lead < 0xE0) {
      length = 2;
      value = lead & 0x1FU;
    } else if (lead >= 0x80) {
      value = U'\uFFFD';
    }
    bool whole = i + length <= text.size();
    for (std::size_t k = 1; whole && k < length; ++k) {
      const auto next = static_cast<unsigned char>(text[i + k]);
      whole = (next & 0xC0U) == 0x80U;
      value = (value << 6U) | (next & 0x3FU);
    }
    out.push_back(whole ? value : U'\uFFFD');
    i += whole ? length : 1;
  }
  return out;
}

Result<FontAtlas> FontAtlas::load(std::string_view family, int pixel_height, std::string_view more) {
  const std::string file = find_font_file(family);
  if (file.empty()) {
    return make_error(ErrorCode::not_found,
                      fmt::format("no font like '{}' is installed; fonts-dejavu-core has one", family));
  }
  FT_Library raw_library = nullptr;
  if (FT_Init_FreeType(&raw_library) != 0) return make_error(ErrorCode::io, "FreeType does not start");
  const std::unique_ptr<FT_LibraryRec_, decltype(&FT_Done_FreeType)> library(raw_library, FT_Done_FreeType);
  FT_Face raw_face = nullptr;
  if (FT_New_Face(raw_library, file.c_str(), 0, &raw_face) != 0) {
    return make_error(ErrorCode::io, fmt::format("FreeType cannot read the font {}", file));
  }
  const std::unique_ptr<FT_FaceRec_, decltype(&FT_Done_Face)> face(raw_face, FT_Done_Face);
  FT_Set_Pixel_Sizes(raw_face, 0, static_cast<FT_UInt>(pixel_height));

  std::u32string characters;
  for (char32_t c = 0x20; c < 0x7F; ++c) characters.push_back(c);
  for (char32_t c = 0xA1; c <= 0xFF; ++c) characters.push_back(c);
  characters += signs;
  characters += decode_utf8(more);

  FontAtlas atlas;
  atlas.width_ = atlas_width_px;
  atlas.pixel_height_ = pixel_height;
  int x = padding_px;
  int y = padding_px;
  int row_height = 0;
  for (const char32_t c : characters) {
    if (atlas.has(c)) continue;
    const FT_UInt index = FT_Get_Char_Index(raw_face, c);
    if (index == 0 || FT_Load_Glyph(raw_face, index, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT) != 0) continue;
    const FT_GlyphSlot slot = raw_face->glyph;
    const FT_Bitmap& bitmap = slot->bitmap;
    const int w = static_cast<int>(bitmap.width);
    const int h = static_cast<int>(bitmap.rows);
    if (w + 2 * padding_px > atlas_width_px) continue;
    if (x + w + padding_px > atlas_width_px) {
      x = padding_px;
      y += row_height + padding_px;
      row_height = 0;
    }
    row_height = std::max(row_height, h);
    const std::size_t needed = static_cast<std::size_t>(y + h + padding_px) * atlas_width_px;
    if (atlas.coverage_.size() < needed) atlas.coverage_.resize(needed, 0);
    for (int row = 0; row < h; ++row) {
      std::copy_n(bitmap.buffer + static_cast<std::ptrdiff_t>(row) * bitmap.pitch, w,
                  atlas.coverage_.begin() + static_cast<std::ptrdiff_t>(y + row) * atlas_width_px + x);
    }
    atlas.glyphs_[c] = Glyph{x,
                             y,
                             w,
                             h,
                             static_cast<float>(slot->bitmap_left),
                             static_cast<float>(slot->bitmap_top),
                             static_cast<float>(slot->advance.x) / 64.0F};
    x += w + padding_px;
  }
  atlas.height_ = static_cast<int>(atlas.coverage_.size() / atlas_width_px);
  if (atlas.glyphs_.count(U'?') == 0) {
    return make_error(ErrorCode::io, fmt::format("the font {} has no Latin letters", file));
  }
  return atlas;
}

const Glyph& FontAtlas::glyph(char32_t character) const {
  const auto found = glyphs_.find(character);
  return found != glyphs_.end() ? found->second : glyphs_.at(U'?');
}

float FontAtlas::measure(std::string_view utf8) const {
  float sum = 0.0F;
  for (const char32_t c : decode_utf8(utf8)) sum += glyph(c).advance;
  return sum / static_cast<float>(pixel_height_);
}

}  // namespace handloft::client
