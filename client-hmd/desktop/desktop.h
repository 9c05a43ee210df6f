#pragma once
// Mouse, keyboard and pen as a hand and a camera (V6): takes events as values in their order, moves the
// camera, and makes what the model server is to be sent. No window, no network, no clock of its own: the
// same events give the same messages.

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client-hmd/desktop/camera_control.h"
#include "client-hmd/desktop/cursor.h"
#include "client-hmd/desktop/desktop_state.h"
#include "client-hmd/desktop/hand_stream.h"
#include "client-hmd/desktop/input.h"
#include "client-hmd/desktop/pointer_work.h"

namespace handloft::client {

struct DesktopOptions {
  bool hand = true;  ///< Else only the camera is moved (--view-only).
  double pressure = 0.5;
  double firm = 0.95;   ///< With Shift held.
  double faint = 0.15;  ///< With Control held.
  double range = 0.3;   ///< Of pushes, at first: a third of a shape follows.
  HandStreamOptions stream;
};

/// The world at one moment; lives for one call. `camera` is moved.
struct DesktopWorld {
  const Scene& scene;
  OrbitCamera& camera;
  PictureSize size;
  bool camera_moves = true;  ///< False while the view follows the head: there is no pointer in that picture.
};

/// Who is there to be sent to.
struct DesktopConnection {
  bool connected = false;
  std::uint64_t client_id = 0;  ///< Another one: a new connection, and an empty workbench.
};

/// What keys asked of the window's picture.
struct DesktopWishes {
  bool close = false;
  bool save_picture = false;
  bool toggle_head = false;
  bool toggle_distances = false;
  bool toggle_zebra = false;
  bool next_light = false;
  bool next_lines = false;
  bool toggle_help = false;
  bool frame_all = false;
  bool frame_selected = false;
};

/// What of the input belongs to somebody else: a panel under the pointer, a text that is being typed.
struct InputTaken {
  bool pointer = false;
  bool keys = false;
};

class Desktop {
 public:
  explicit Desktop(DesktopOptions options = {});

  /// Before the events of a frame.
  void set_connection(const DesktopConnection& connection);
  void set_taken(const InputTaken& taken) { taken_ = taken; }
  /// In order of time. A button that went down on a panel stays the panel's until it is up.
  void on_event(const InputEvent& event, const DesktopWorld& world);
  void on_command(const DesktopCommand& command, TimePoint time, const DesktopWorld& world);
  /// After the events of a frame: what waits is told, and the cursor is where the pointer is.
  void on_frame(TimePoint now, const DesktopWorld& world);
  /// Something that this desktop asked for was refused: told for some seconds.
  void on_refusal(std::string words, TimePoint now);
  /// Something was done, and there is more to tell of it.
  void on_note(std::string words, TimePoint now);

  /// What the model server is to be sent, in this order.
  std::vector<HandMessage> take_messages() { return stream_.take(); }
  DesktopWishes take_wishes() { return std::exchange(wishes_, {}); }
  const DesktopState& state() const { return state_; }

 private:
  enum class Holding { nothing, work, orbit, pan };

  void on_button(const ButtonChanged& button, const InputEvent& event, const DesktopWorld& world);
  void on_pointer(const glm::dvec2& at_px, TimePoint time, const DesktopWorld& world);
  void on_wheel(double steps, const InputEvent& event, const DesktopWorld& world);
  void on_key(const KeyChanged& key, const InputEvent& event, const DesktopWorld& world);
  void on_pressure(double pressure, TimePoint time);
  void let_go(TimePoint time);
  void begin_work(TimePoint time, const DesktopWorld& world);
  void end_work(TimePoint time);
  void begin_view(Holding holding, const DesktopWorld& world);
  bool hand_ready(TimePoint time);
  bool do_view(DesktopAction action, const DesktopWorld& world);
  bool do_cursor(DesktopAction action, TimePoint time, const DesktopWorld& world);
  void turn(DesktopAction action, TimePoint time, const DesktopWorld& world);
  void turn_by_pointer(const glm::dvec2& moved_px, TimePoint time, const DesktopWorld& world);
  void change_range(double steps, TimePoint time);
  void set_tool(DesktopTool tool, TimePoint time);
  void give(PaletteCommand command, TimePoint time);
  void retouch(TimePoint time);
  double pressure() const;
  double potentiometer() const;
  HandTouch touch() const { return {pressure(), potentiometer()}; }
  bool along_normal() const;
  glm::dvec3 under_pointer(const DesktopWorld& world);
  void tell(TimePoint now, const DesktopWorld& world);

  DesktopOptions options_;
  HandStream stream_;
  Picker picker_;
  CursorSettings cursor_settings_;
  DesktopConnection connection_;
  InputTaken taken_;
  DesktopWishes wishes_;
  DesktopState state_;

  DesktopTool tool_ = DesktopTool::lay;
  PerTool<std::optional<bool>> along_{};
  double base_pressure_ = 0.5;
  double pen_pressure_ = 0.0;
  double range_ = 0.3;
  double bend_ = 1.0;   ///< Reach of a curve icon's bend: all of it.
  int size_steps_ = 0;  ///< Of the shape that is being moved.
  Modifiers modifiers_;
  std::set<std::string> held_;  ///< Keys.

  Holding holding_ = Holding::nothing;
  PointerButton holding_button_ = PointerButton::left;
  std::optional<PointerWork> work_;
  bool corner_picked_ = false;  ///< The region tool's first corner, by a tap.
  glm::dvec3 pivot_{0.0};       ///< Of the view.
  glm::dvec2 pointer_px_{0.0};
  bool pointer_inside_ = false;
  std::optional<Cursor> cursor_;
  std::optional<TimePoint> refusal_until_;
  std::optional<TimePoint> note_until_;
};

}  // namespace handloft::client
