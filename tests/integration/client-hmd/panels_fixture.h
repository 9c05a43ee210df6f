#pragma once
// Panels over a real picture, drawn on EGL without a display, and driven by events as a window makes them.

#include "client-hmd/desktop/key_map.h"
#include "client-hmd/hud/panels.h"
#include "client-hmd/render/targets.h"
#include "tests/integration/client-hmd/rendering_fixture.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client::test {

class PanelsOverPicture : public Rendering {
 protected:
  void SetUp() override {
    Rendering::SetUp();
    settings_.tour_done = true;
    scene_ = shell_scene();
    model_.connected = true;
    model_.snapshots = 1;
    desktop_.available = true;
    desktop_.tool_words = "Lay points";
    desktop_.hint = "Hold the left button and paint points.";
    desktop_.plane_words = "level";
    desktop_.pressure = 0.62;
    desktop_.range = 0.35;
    desktop_.cursor_words = "x -12.0  y 40.5  z 50.0 mm";
    latency_ms_ = 34.0;
  }
  void TearDown() override {
    panels_.reset();
    Rendering::TearDown();
  }

  /// The shell of the other tests, fitted and selected, and what stands around it.
  static std::shared_ptr<Scene> shell_scene() {
    auto scene = std::make_shared<Scene>(*synthetic_scene());
    scene->epoch = 7;
    scene->sequence = 1204;
    scene->history = {17, 2, "Push 41 points of \"Shell\"", "Fit \"Shell\"", "", ""};
    scene->alternatives = {"round", {"round", "edgy", "flat"}};
    for (auto& [id, entity] : scene->entities) {
      auto changed = std::make_shared<Entity>(*entity);
      changed->name = "Shell";
      changed->selected = true;
      changed->residual_rms_m = 0.00031;
      changed->representation = Representation::both;
      entity = changed;
    }
    auto grip = std::make_shared<Entity>();
    grip->id = "shape-2";
    grip->name = "Grip";
    grip->points = stroke_points();
    grip->representation = Representation::surface;  // Not to be seen in the picture.
    scene->entities["shape-2"] = grip;
    auto housing = std::make_shared<Entity>();
    housing->id = "reference-1";
    housing->name = "Housing of the sensor";
    housing->kind = EntityKind::reference;
    scene->entities["reference-1"] = housing;
    return scene;
  }

  void make_panels() {
    Result<std::unique_ptr<Panels>> panels = Panels::create(settings_);
    ASSERT_TRUE(panels.ok()) << panels.error().describe();
    panels_ = std::move(*panels);
  }

  void person(std::uint64_t id, const std::string& name, const std::string& tool) {
    Activity activity;
    activity.client_id = id;
    activity.name = name;
    activity.tool = tool;
    model_.activities[{id, name}] = activity;
  }

  /// One frame of panels over whatever is in the target; keeps what was asked for.
  void frame() {
    model_.scene = scene_;
    const PanelFacts facts{.model = model_,
                           .tracking = tracking_,
                           .tracking_wanted = tracking_wanted_,
                           .lag = lag_,
                           .latency_ms = latency_ms_,
                           .frames_per_second = 60.0,
                           .desktop = desktop_,
                           .view = view_,
                           .colours = settings_.colours,
                           .keys = key_help()};
    now_ += std::chrono::milliseconds(16);
    Result<std::vector<PanelRequest>> requests =
        panels_->draw(facts, {width_, height_, 1.0F, now_, target_.framebuffer()});
    ASSERT_TRUE(requests.ok()) << requests.error().describe();
    requests_.insert(requests_.end(), requests->begin(), requests->end());
  }

  /// A plain ground: pictures of panels do not change with what the scene looks like.
  enum class Under { plain, scene };
  /// Panels over it, after enough frames for everything to have its size.
  Image picture(int width, int height, Under under = Under::plain) {
    width_ = width;
    height_ = height;
    EXPECT_TRUE(target_.resize(width, height).ok());
    if (panels_ == nullptr) make_panels();
    frame();
    frame();
    if (under == Under::scene) {
      put(draw(frame_of(scene_, width, height)));
    } else {
      glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer());
      glClearColor(0.62F, 0.64F, 0.66F, 1.0F);
      glClear(GL_COLOR_BUFFER_BIT);
    }
    frame();
    return read(width, height);
  }

  /// A picture into the target, upside down as OpenGL has them.
  void put(const Image& image) const {
    const GlTexture texture = GlTexture::create();
    const GlFramebuffer source = GlFramebuffer::create();
    glBindTexture(GL_TEXTURE_2D, texture.id());
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, image.width_px, image.height_px, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                 image.rgba.data());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, source.id());
    glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture.id(), 0);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target_.framebuffer());
    glBlitFramebuffer(0, 0, image.width_px, image.height_px, 0, image.height_px, image.width_px, 0,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }

  Image read(int width, int height) const {
    Image image{width, height, std::vector<std::uint8_t>(4 * static_cast<std::size_t>(width * height))};
    glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer());
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    const std::size_t row = 4 * static_cast<std::size_t>(width);
    for (int y = 0; y < height; ++y) {
      glReadPixels(0, height - 1 - y, width, 1, GL_RGBA, GL_UNSIGNED_BYTE,
                   image.rgba.data() + static_cast<std::size_t>(y) * row);
    }
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
    return image;
  }

  template <typename What>
  bool event(const What& what, const Modifiers& modifiers = {}) {
    return panels_->handle({now_, modifiers, what});
  }
  /// Where a widget is; draws a frame first so that it is where it is said to be.
  glm::dvec2 middle_of(const std::string& widget) {
    const std::optional<PixelRect> place = panels_->place_of(widget);
    EXPECT_TRUE(place.has_value()) << widget << " is not to be seen";
    return place ? glm::dvec2(place->middle()) : glm::dvec2(-1.0);
  }
  void click(const glm::dvec2& at) {
    event(PointerMoved{at});
    frame();
    event(ButtonChanged{PointerButton::left, true, at});
    frame();
    event(ButtonChanged{PointerButton::left, false, at});
    frame();
    frame();
  }
  void click(const std::string& widget) { click(middle_of(widget)); }
  void key(const std::string& name, const Modifiers& modifiers = {}) {
    event(KeyChanged{name, true, false}, modifiers);
    event(KeyChanged{name, false, false}, modifiers);
    frame();
    frame();
  }
  void type(std::string_view text) {
    for (const char character : text) {
      const bool small = character >= 'a' && character <= 'z';
      const bool capital = character >= 'A' && character <= 'Z';
      const std::string name =
          character == ' ' ? "Space"
                           : std::string(1, small ? static_cast<char>(character - 'a' + 'A') : character);
      key(name, {.shift = capital, .control = false, .alt = false});
    }
  }
  template <typename Request>
  std::vector<Request> asked() const {
    std::vector<Request> of_kind;
    for (const PanelRequest& request : requests_) {
      if (const auto* one = std::get_if<Request>(&request)) of_kind.push_back(*one);
    }
    return of_kind;
  }
  /// The palette's commands that were given.
  std::vector<PaletteCommand> given() const {
    std::vector<PaletteCommand> commands;
    for (const DesktopCommand& command : asked<DesktopCommand>()) {
      if (command.action == DesktopAction::command) commands.push_back(command.command);
    }
    return commands;
  }

  HudSettings settings_;
  std::shared_ptr<Scene> scene_;
  ModelState model_;
  TrackingStatus tracking_;
  bool tracking_wanted_ = false;
  std::optional<Duration> lag_;
  double latency_ms_ = 0.0;
  DesktopState desktop_;
  ViewChoices view_;
  std::unique_ptr<Panels> panels_;
  std::vector<PanelRequest> requests_;
  OutputTarget target_;
  TimePoint now_{std::chrono::seconds(1000)};
  int width_ = 1280, height_ = 720;
};

}  // namespace handloft::client::test
