#include "client-hmd/render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "client-hmd/render/curvature_map.h"
#include "client-hmd/render/flat_pass.h"
#include "client-hmd/render/gesture_pass.h"
#include "client-hmd/render/ghost_pass.h"
#include "client-hmd/render/hand_occlusion.h"
#include "client-hmd/render/icon_pass.h"
#include "client-hmd/render/mark_pass.h"
#include "client-hmd/render/net_pass.h"
#include "client-hmd/render/pin_labels.h"
#include "client-hmd/render/present_pass.h"
#include "client-hmd/render/stage_pass.h"
#include "client-hmd/render/targets.h"
#include "client-hmd/render/veil.h"

namespace handloft::client {
namespace {

constexpr std::string_view resolve_glsl = R"glsl(
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_sum;
uniform sampler2D u_weight;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(u_sum, pixel, 0);
  float weight = texelFetch(u_weight, pixel, 0).r;
  if (sum.a >= 0.9995) discard;
  out_colour = vec4(sum.rgb / max(weight, 1e-5), 1.0 - sum.a);
}
)glsl";

constexpr std::string_view copy_glsl = R"glsl(
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_sum;
void main() { out_colour = texelFetch(u_sum, ivec2(gl_FragCoord.xy), 0); }
)glsl";

}  // namespace

struct Renderer::Implementation {
  StagePass stage;
  SurfacePass surfaces;
  PointPass points;
  MarkPass marks;
  GesturePass gestures;
  IconPass icons;
  NetPass nets;
  GhostPass ghosts;
  HandOcclusionPass hand;
  Veil veil;
  FlatPass flat;
  GlProgram resolve;
  GlProgram copy;
  PresentPass presenting;
  GlVertexArray no_vertices;
  /// What a slot's picture is like, once there is one.
  struct Composed {
    glm::vec2 size_px{0.0F};
    int samples = 0;
    std::optional<CurvatureView> legend;  ///< With its range, when it shows curvature.
    ColourScheme colours = ColourScheme::normal;
  };
  std::array<Composed, 2> composed;
  PictureSlot slot = PictureSlot::only;  ///< Whose targets `targets` are.
  Targets targets;
  Targets other_targets;
  OutputTarget overlay_layer;
  OutputTarget canvas;
  std::shared_ptr<const Scene> resident = std::make_shared<const Scene>();

  void fullscreen(const GlProgram& program) const {
    program.use();
    glBindVertexArray(no_vertices.id());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

  void draw_transparent_stage(const Frame& frame, const EyeUniforms& eye, Stage which) {
    surfaces.draw(*resident, eye, which);
    points.draw(*resident, eye, which);
    ghosts.draw(eye, which);
    marks.draw_transparent(frame, eye, which);
  }

  /// Surfaces first, then the points on top of them: a thin layer of ink just before a nearly opaque one is
  /// where the weighted average errs most. The surfaces' veil fades the points behind them.
  Status blend_weighted(const Frame& frame, const EyeUniforms& eye,
                        const TransparencyWeights& surface_weights) {
    EyeUniforms behind = eye;
    const bool veiled = surfaces.any_transparent(*resident) || frame.symmetry ||
                        std::any_of(frame.fingers.begin(), frame.fingers.end(),
                                    [](const FingerMark& finger) { return finger.opacity < 1.0F; });
    if (veiled) {
      if (const Status blended = blend_surfaces(frame, eye, surface_weights); !blended) return blended;
      behind.behind_veil = true;
    }
    begin_sums();
    if (veiled) bind_texture(9, GL_TEXTURE_2D, veil.texture());
    points.draw(*resident, behind, Stage::weighted);
    ghosts.draw(behind, Stage::weighted);
    resolve_sums();
    return {};
  }

  /// The nearest layer exactly, all behind it by weights: few surfaces overlap more than twice.
  Status blend_surfaces(const Frame& frame, const EyeUniforms& eye,
                        const TransparencyWeights& surface_weights) {
    targets.begin_peeling();
    begin_layer(0);
    surfaces.draw(*resident, eye, Stage::peel);
    marks.draw_transparent(frame, eye, Stage::peel);

    EyeUniforms rest = eye;
    rest.behind_front = true;
    rest.weights = surface_weights;
    begin_sums();
    bind_texture(7, GL_TEXTURE_2D, targets.last_layer_depth(1));
    surfaces.draw(*resident, rest, Stage::weighted);
    marks.draw_transparent(frame, rest, Stage::weighted);
    resolve_sums();

    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    bind_texture(0, GL_TEXTURE_2D, targets.layer_colour());
    copy.use();
    copy.set("u_sum", 0);
    fullscreen(copy);
    glDisable(GL_BLEND);
    return veil.keep({.sum = targets.sum(),
                      .weight = targets.weight(),
                      .front = targets.layer_colour(),
                      .front_depth = targets.last_layer_depth(1)},
                     glm::vec2(eye.clip_from_eye[2][2], eye.clip_from_eye[3][2]),
                     static_cast<int>(eye.viewport_px.x), static_cast<int>(eye.viewport_px.y));
  }

  void begin_sums() {
    targets.bind_weighted();
    constexpr std::array<float, 4> no_light_all_through{0.0F, 0.0F, 0.0F, 1.0F};
    constexpr std::array<float, 4> no_weight{0.0F, 0.0F, 0.0F, 0.0F};
    glClearBufferfv(GL_COLOR, 0, no_light_all_through.data());
    glClearBufferfv(GL_COLOR, 1, no_weight.data());
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_FALSE);
    glEnable(GL_BLEND);
    // One function for both: colours and weights add up, what shines through multiplies.
    glBlendFuncSeparate(GL_ONE, GL_ONE, GL_ZERO, GL_ONE_MINUS_SRC_ALPHA);
  }

  void resolve_sums() {
    glDepthMask(GL_TRUE);
    targets.bind_picture();
    glDisable(GL_DEPTH_TEST);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    bind_texture(0, GL_TEXTURE_2D, targets.sum());
    bind_texture(1, GL_TEXTURE_2D, targets.weight());
    resolve.use();
    resolve.set("u_sum", 0);
    resolve.set("u_weight", 1);
    fullscreen(resolve);
    glDisable(GL_BLEND);
  }

  /// What is drawn from now on goes into a layer of its own: the nearest behind the last one.
  void begin_layer(int layer) {
    targets.bind_layer(layer);
    constexpr std::array<float, 4> nothing{0.0F, 0.0F, 0.0F, 0.0F};
    constexpr float farthest = 1.0F;
    glClearBufferfv(GL_COLOR, 0, nothing.data());
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glClearBufferfv(GL_DEPTH, 0, &farthest);
    glDisable(GL_BLEND);
    bind_texture(6, GL_TEXTURE_2D, targets.opaque_depth());
    bind_texture(7, GL_TEXTURE_2D, targets.last_layer_depth(layer));
  }

  void blend_peeled(const Frame& frame, const EyeUniforms& eye) {
    targets.begin_peeling();
    GlQuery query = GlQuery::create();
    for (int layer = 0; layer < max_peeled_layers; ++layer) {
      begin_layer(layer);
      glBeginQuery(GL_SAMPLES_PASSED, query.id());
      draw_transparent_stage(frame, eye, Stage::peel);
      glEndQuery(GL_SAMPLES_PASSED);
      GLuint pixels = 0;
      glGetQueryObjectuiv(query.id(), GL_QUERY_RESULT, &pixels);
      if (pixels == 0) break;

      targets.bind_peeled_sum();
      glDisable(GL_DEPTH_TEST);
      glEnable(GL_BLEND);
      // Under what is there already: weighted by what still shines through (kept in alpha).
      glBlendFuncSeparate(GL_DST_ALPHA, GL_ONE, GL_ZERO, GL_ONE_MINUS_SRC_ALPHA);
      bind_texture(0, GL_TEXTURE_2D, targets.layer_colour());
      copy.use();
      copy.set("u_sum", 0);
      fullscreen(copy);
    }
    targets.bind_picture();
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_ONE, GL_SRC_ALPHA, GL_ZERO, GL_ONE);
    bind_texture(0, GL_TEXTURE_2D, targets.sum());
    copy.use();
    copy.set("u_sum", 0);
    fullscreen(copy);
    glDisable(GL_BLEND);
  }

  void select(PictureSlot wanted) {
    if (wanted != slot) std::swap(targets, other_targets);
    slot = wanted;
  }

  Status draw_scene(const Frame& frame, const RenderOptions& options, PictureSlot into) {
    select(into);
    composed[static_cast<std::size_t>(into)] = {};
    const Pinhole& pinhole = frame.eye.pinhole;
    if (const Status good = check_pinhole(pinhole); !good) return good.error();
    const int samples = std::clamp(options.supersampling, 1, 4);
    const int width = pinhole.width_px * samples;
    const int height = pinhole.height_px * samples;
    if (const Status sized = targets.resize(width, height); !sized) return sized.error();

    EyeUniforms eye;
    eye.eye_from_world = glm::mat4(frame.eye.eye_from_world());
    eye.clip_from_eye = glm::mat4(projection_matrix(pinhole, frame.eye.depth));
    eye.position = glm::vec3(frame.eye.world_from_eye.position);
    eye.viewport_px = glm::vec2(width, height);
    eye.focal_px = static_cast<float>(pinhole.fy_px) * static_cast<float>(samples);
    eye.weights = options.weights;

    const std::shared_ptr<const Scene> scene = frame.scene ? frame.scene : std::make_shared<const Scene>();
    const bool changed = scene != resident;
    if (changed) {
      resident = scene;
      surfaces.update(*scene);
      points.update(*scene, surfaces);
      gestures.update(*scene);
    }
    if (points.follow(*scene, options.points) || changed) stage.update_shadow(*scene, surfaces, points);

    if (const Status built = ghosts.prepare(frame, eye, width, height); !built) return built.error();
    std::map<std::uint64_t, glm::vec3> users;
    for (const GhostHint& ghost : frame.ghosts) users.emplace(ghost.client_id, ghost.colour);
    points.show_users(std::move(users));
    surfaces.show(frame, stage.surroundings());
    if (options.curvatures == Curvatures::awaited) surfaces.await_curvatures();
    targets.bind_picture();
    glViewport(0, 0, width, height);
    glDepthMask(GL_TRUE);
    const glm::vec3 backdrop = frame.plain_backdrop.value_or(glm::vec3(0.0F));
    glClearColor(backdrop.x, backdrop.y, backdrop.z, 1.0F);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    if (!frame.plain_backdrop) stage.draw_background(frame);
    const Result<bool> hidden_by_hand = hand.prepare(frame, eye, targets);
    if (!hidden_by_hand) return hidden_by_hand.error();
    if (!frame.plain_backdrop) stage.draw_table(frame, eye);
    if (!frame.plain_backdrop && frame.surroundings == Surroundings::workplace) {
      flat.draw_palette(frame, eye);
      flat.draw_sheets(frame.sheets, eye);
    }

    glEnable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    surfaces.draw(*scene, eye, Stage::opaque);
    marks.draw_curves(frame, eye);
    icons.draw(*scene, eye);
    if (*hidden_by_hand) {
      hand.cover(targets);
      eye.hand_before = true;
      bind_texture(8, GL_TEXTURE_2D, hand.mask());
      glEnable(GL_DEPTH_TEST);
    }
    marks.draw_fingertips(frame, eye);
    if (options.transparency == Transparency::depth_peeling) {
      blend_peeled(frame, eye);
    } else if (const Status blended = blend_weighted(frame, eye, options.surface_weights); !blended) {
      return blended;
    }
    targets.bind_picture();
    nets.draw(frame, eye);
    gestures.draw(frame, eye);
    icons.draw_halos(*scene, eye);
    flat.draw_labels(icon_labels(*scene, eye), eye);
    flat.draw_labels(ghost_labels(frame.ghosts, eye), eye);
    flat.draw_labels(gestures.holder_labels(frame, eye), eye);
    flat.draw_labels(pin_labels(frame.pins, eye), eye);
    marks.draw_cursor(frame, eye);

    Composed& done = composed[static_cast<std::size_t>(into)];
    done = {glm::vec2(pinhole.width_px, pinhole.height_px), samples, std::nullopt, frame.colours};
    if (frame.shading == Shading::curvature) {
      done.legend = CurvatureView{frame.curvature.kind, surfaces.curvature_range()};
    }
    return {};
  }

  Status present(const Presentation& how, const Overlay& asked, PictureSlot from, unsigned target) {
    select(from);
    const Composed& picture = composed[static_cast<std::size_t>(from)];
    if (picture.samples == 0) return make_error(ErrorCode::failed_precondition, "nothing was drawn yet");
    Overlay overlay = asked;
    if (picture.legend) {
      const auto [width, height] = how.lens == nullptr ? std::pair{how.area.width_px, how.area.height_px}
                                                       : std::pair{how.shown.width_px, how.shown.height_px};
      add_curvature_legend(picture.legend->kind, picture.legend->range_per_m,
                           scene_colours(picture.colours).curvature, width, height, overlay);
    }
    FinishedPicture finished{targets.picture(), picture.size_px, picture.samples, 0};
    const bool over_lens = how.lens != nullptr && !(overlay.panels.empty() && overlay.texts.empty());
    if (over_lens) {
      if (const Status sized = overlay_layer.resize(how.shown.width_px, how.shown.height_px); !sized) {
        return sized.error();
      }
      overlay_layer.clear();
      glViewport(0, 0, how.shown.width_px, how.shown.height_px);
      flat.draw_overlay(overlay, how.shown.width_px, how.shown.height_px);
      finished.overlay = overlay_layer.texture();
    }
    glBindFramebuffer(GL_FRAMEBUFFER, target);
    presenting.draw(finished, how);
    if (how.lens == nullptr) flat.draw_overlay(overlay, how.area.width_px, how.area.height_px);
    return {};
  }
};

Renderer::Renderer(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
Renderer::~Renderer() = default;

Result<std::unique_ptr<Renderer>> Renderer::create() {
  if (epoxy_gl_version() < 33) {
    return make_error(ErrorCode::unsupported, fmt::format("found OpenGL {}.{}, expected 3.3 or later",
                                                          epoxy_gl_version() / 10, epoxy_gl_version() % 10));
  }
  auto parts = std::make_unique<Implementation>();
  const auto take = [](auto result, auto& into) -> Status {
    if (!result) return result.error();
    into = std::move(*result);
    return {};
  };
  const std::array vertex{fullscreen_vertex_glsl};
  const std::array resolve{resolve_glsl};
  const std::array copy{copy_glsl};
  for (const Status& made :
       {take(StagePass::create(), parts->stage), take(SurfacePass::create(), parts->surfaces),
        take(PointPass::create(), parts->points), take(MarkPass::create(), parts->marks),
        take(GesturePass::create(), parts->gestures), take(IconPass::create(), parts->icons),
        take(NetPass::create(), parts->nets), take(GhostPass::create(), parts->ghosts),
        take(HandOcclusionPass::create(), parts->hand), take(Veil::create(), parts->veil),
        take(FlatPass::create(), parts->flat), take(PresentPass::create(), parts->presenting),
        take(GlProgram::build("resolve", vertex, resolve), parts->resolve),
        take(GlProgram::build("copy", vertex, copy), parts->copy)}) {
    if (!made) return made.error();
  }
  parts->no_vertices = GlVertexArray::create();
  parts->stage.update_shadow(*parts->resident, parts->surfaces, parts->points);
  return std::unique_ptr<Renderer>(new Renderer(std::move(parts)));
}

Status Renderer::draw_scene(const Frame& frame, const RenderOptions& options, PictureSlot slot) {
  return implementation_->draw_scene(frame, options, slot);
}

Status Renderer::present(const Presentation& how, const Overlay& overlay, PictureSlot slot, unsigned target) {
  return implementation_->present(how, overlay, slot, target);
}

void Renderer::clear(unsigned target) {
  glBindFramebuffer(GL_FRAMEBUFFER, target);
  glClearColor(0.0F, 0.0F, 0.0F, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
}

Result<unsigned> Renderer::own_canvas(int width_px, int height_px) {
  if (const Status sized = implementation_->canvas.resize(width_px, height_px); !sized) return sized.error();
  implementation_->canvas.clear();
  return implementation_->canvas.framebuffer();
}

Image Renderer::read_canvas() const {
  return implementation_->canvas.read();
}

void Renderer::finish() {
  glFinish();
}

Status Renderer::draw_offscreen(const Frame& frame, const RenderOptions& options) {
  if (const Status drawn = draw_scene(frame, options); !drawn) return drawn;
  const Presentation how = whole_picture(frame);
  const Result<unsigned> canvas = own_canvas(how.area.width_px, how.area.height_px);
  if (!canvas) return canvas.error();
  if (const Status shown = present(how, frame.overlay, PictureSlot::only, *canvas); !shown) return shown;
  glFinish();  // The frame counts when it is there, not when it is queued.
  return {};
}

Result<Image> Renderer::draw_to_image(const Frame& frame, const RenderOptions& options) {
  RenderOptions still = options;
  still.curvatures = Curvatures::awaited;  // Nobody waits for the next frame.
  still.points = PointDetail::all;
  if (const Status drawn = draw_offscreen(frame, still); !drawn) return drawn.error();
  return read_canvas();
}

float Renderer::measure_text(std::string_view utf8) const {
  return implementation_->flat.measure(utf8);
}

}  // namespace handloft::client
