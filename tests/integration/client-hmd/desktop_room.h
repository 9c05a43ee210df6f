#pragma once
// Somebody at a desk before the real model: events go into the client's Desktop, what it says goes into the
// server's Interaction, and the model comes back as the server streams it and the client mirrors it. Only the
// sockets and the window are left out.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client-hmd/desktop/desktop.h"
#include "client-hmd/mirror/scene_mirror.h"
#include "server-model/interaction/interaction.h"
#include "server-model/stream/mesh_cache.h"
#include "server-model/stream/scene_builder.h"
#include "server-model/stream/viewer.h"

namespace handloft::client::test {

using namespace std::chrono_literals;

class DesktopRoom : public ::testing::Test {
 protected:
  DesktopRoom() {
    desktop_.set_connection({true, 7});
    frame();
  }

  DesktopWorld world() { return {*mirror_.scene(), camera_, size_}; }
  Eye eye() const { return camera_.eye(size_.width_px, size_.height_px); }
  glm::dvec2 pixel(const glm::dvec3& place) const { return *seen_at(eye(), place); }

  template <typename What>
  void event(const What& what, Duration after = 4ms) {
    now_ += after;
    InputEvent event;
    event.time = now_;
    event.modifiers = modifiers_;
    event.what = what;
    desktop_.on_event(event, world());
    if (now_ - framed_at_ >= frame_interval_) frame();
  }
  void frame() {
    framed_at_ = now_;
    desktop_.on_frame(now_, world());
    deliver();
    scene_anew();
  }
  void wait(Duration duration) {
    for (Duration gone{}; gone < duration; gone += frame_interval_) {
      now_ += frame_interval_;
      frame();
    }
  }
  void move_to(const glm::dvec2& at_px) { event(PointerMoved{at_px_ = at_px}); }
  void press(PointerButton button = PointerButton::left) { event(ButtonChanged{button, true, at_px_}); }
  void release(PointerButton button = PointerButton::left) { event(ButtonChanged{button, false, at_px_}); }
  void key(const std::string& name) {
    event(KeyChanged{name, true, false});
    event(KeyChanged{name, false, false});
  }
  /// In steps as a mouse reports them.
  void go_to(const glm::dvec2& to_px, double step_px = 5.0) {
    const glm::dvec2 from = at_px_;
    const int steps = std::max(1, static_cast<int>(glm::distance(from, to_px) / step_px));
    for (int i = 1; i <= steps; ++i) move_to(from + (to_px - from) * (static_cast<double>(i) / steps));
  }
  void drag(const std::vector<glm::dvec2>& path_px) {
    move_to(path_px.front());
    frame();
    press();
    for (std::size_t i = 1; i < path_px.size(); ++i) go_to(path_px[i]);
    release();
    frame();
  }
  void drag_through(const std::vector<glm::dvec3>& places) {
    std::vector<glm::dvec2> path;
    for (const glm::dvec3& place : places) path.push_back(pixel(place));
    drag(path);
  }

  void deliver() {
    for (HandMessage& message : desktop_.take_messages()) {
      if (const auto* command = std::get_if<PaletteCommand>(&message)) {
        interaction::FrameOutcome outcome;
        const interaction::CommandAnswer answer = interaction_.command(0, *command, outcome);
        if (!answer.refusal.empty()) problems_.push_back(answer.words + ": " + answer.refusal);
        take(std::move(outcome));
      } else if (const auto* frame = std::get_if<v1::TrackingFrame>(&message)) {
        take(interaction_.on_frame(*frame));
      } else {
        submit(std::get<v1::Operation>(message));
      }
    }
  }
  void take(interaction::FrameOutcome outcome) {
    for (const std::string& problem : outcome.problems) problems_.push_back(problem);
    for (model::Submitted& submitted : outcome.submitted) done_.push_back(submitted.effective);
  }
  void submit(const v1::Operation& operation) {
    const auto submitted = model_.submit(operation);
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
  }
  void scene_anew() {
    // The first build asks for the meshes, the second has them.
    (void)builder_.build(model_, 0);
    const stream::ScenePtr scene = builder_.build(model_, 0);
    while (const auto message = viewer_.next(*scene)) {
      const Status applied =
          message->has_snapshot() ? mirror_.apply(message->snapshot()) : mirror_.apply(message->delta());
      ASSERT_TRUE(applied.ok()) << applied.error().describe();
    }
  }
  const model::DualShape& shape(const std::string& id) { return *model_.document().find_dual(id); }
  const v1::Operation& last() const { return done_.back(); }

  model::Model model_;
  interaction::Interaction interaction_{model_};
  stream::MeshCache meshes_{[](const std::function<void()>& job) { job(); }, [] {}};
  stream::SceneBuilder builder_{1, meshes_};
  stream::Viewer viewer_;
  SceneMirror mirror_;
  Desktop desktop_;
  OrbitCamera camera_;
  PictureSize size_{1280, 720};
  Modifiers modifiers_;
  Duration frame_interval_ = 16ms;
  TimePoint now_ = from_ns(1'000'000'000);
  TimePoint framed_at_;
  glm::dvec2 at_px_{0.0};
  std::vector<std::string> problems_;
  std::vector<v1::Operation> done_;
};

}  // namespace handloft::client::test
