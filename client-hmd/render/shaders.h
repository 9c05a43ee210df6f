#pragma once
// GLSL that several passes share.

#include <string_view>

namespace handloft::client {

/// A triangle over the whole picture; passes `uv` in 0..1.
extern const std::string_view fullscreen_vertex_glsl;

/// A square about u_centre towards the eye, as a strip of four: passes `corner` in -1..1 and `centre_in_eye`;
/// u_reach is half its side.
extern const std::string_view billboard_vertex_glsl;

/// emit(colour, alpha, eye_depth): writes a fragment for the stage that `u_stage` names (see Stage).
extern const std::string_view emit_glsl;

/// studio_light(normal, to_eye, base, gloss): linear colour under the studio's lamps. Also room() and fill(),
/// the light from one direction and from all, for other materials.
extern const std::string_view studio_light_glsl;

/// Which fragments a draw of mixed opacity keeps and where it writes them; values of `u_stage`.
enum class Stage : int {
  opaque = 0,    ///< Only what is as good as opaque, with depth.
  weighted = 1,  ///< The rest, into the sums of weighted blending.
  peel = 2,      ///< The rest, next layer behind `u_last_depth`, premultiplied.
  coverage = 3,  ///< Opacity and height over the table, from above, for shadows; see StagePass.
  mask = 4,      ///< Depth of what is at least half opaque.
};

}  // namespace handloft::client
