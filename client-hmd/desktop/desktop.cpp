#include "client-hmd/desktop/desktop.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "client-hmd/desktop/key_map.h"

namespace handloft::client {
namespace {

constexpr double pressure_step = 0.1;
constexpr double range_step = 0.05;
constexpr double plane_step_m = 0.005;
/// From 0.1 rad on the server counts turns whole (FistOptions::turn_slack_rad); 24 of these are a half turn.
constexpr double turn_step_rad = glm::pi<double>() / 24.0;
constexpr double view_step_px = 20.0;
constexpr Duration refusal_shown = std::chrono::seconds(4);  ///< As long as reading it takes.
/// A region's tap, against a drag: InteractionOptions::icon_curve_m.
constexpr double tap_m = 0.008;
/// Size while moving: the server doubles it by half of the potentiometer's turn, beyond a slack
/// (InteractionOptions::dial_slack) of which this is a bit more.
constexpr double dial_middle = 0.5;
constexpr double dial_slack = 0.03;
constexpr double dial_step = 0.025;
constexpr int most_size_steps = 18;

}  // namespace

Desktop::Desktop(DesktopOptions options)
    : options_(options), stream_(options.stream), base_pressure_(options.pressure), range_(options.range) {}

void Desktop::set_connection(const DesktopConnection& connection) {
  const bool anew =
      connection.connected && (!connection_.connected || connection.client_id != connection_.client_id);
  if (anew || (!connection.connected && connection_.connected)) {
    stream_.connected_anew();
    work_.reset();
    corner_picked_ = false;
    if (holding_ == Holding::work) holding_ = Holding::nothing;
  }
  connection_ = connection;
}

bool Desktop::hand_ready(TimePoint time) {
  if (!options_.hand) return false;
  if (connection_.connected) return true;
  on_refusal("the model server is not there: nothing was done", time);
  return false;
}

void Desktop::on_refusal(std::string words, TimePoint now) {
  state_.refusal = std::move(words);
  ++state_.refusals;
  refusal_until_ = now + refusal_shown;
}

void Desktop::on_note(std::string words, TimePoint now) {
  state_.note = std::move(words);
  note_until_ = now + refusal_shown;
}

double Desktop::pressure() const {
  if (pen_pressure_ > 0.0) return pen_pressure_;
  if (modifiers_.shift) return options_.firm;
  if (modifiers_.control) return options_.faint;
  return base_pressure_;
}

double Desktop::potentiometer() const {
  if (tool_ == DesktopTool::move) {
    if (size_steps_ == 0) return dial_middle;
    return dial_middle + std::copysign(dial_slack, size_steps_) + dial_step * size_steps_;
  }
  const bool icon = work_ ? work_->holds_icon() : cursor_ && cursor_->over && !cursor_->over->icon.empty();
  return tool_ == DesktopTool::push && icon ? bend_ : range_;
}

bool Desktop::along_normal() const {
  return of_tool(along_, tool_).value_or(tool_ == DesktopTool::push);
}

void Desktop::on_event(const InputEvent& event, const DesktopWorld& world) {
  const Modifiers before = std::exchange(modifiers_, event.modifiers);
  const bool pressed_otherwise = before.shift != modifiers_.shift || before.control != modifiers_.control;
  if (const auto* moved = std::get_if<PointerMoved>(&event.what)) {
    on_pointer(moved->at_px, event.time, world);
  } else if (const auto* button = std::get_if<ButtonChanged>(&event.what)) {
    on_button(*button, event, world);
  } else if (const auto* wheel = std::get_if<WheelTurned>(&event.what)) {
    if (!taken_.pointer) on_wheel(wheel->steps, event, world);
  } else if (const auto* key = std::get_if<KeyChanged>(&event.what)) {
    on_key(*key, event, world);
  } else if (const auto* pen = std::get_if<PenPressed>(&event.what)) {
    on_pressure(pen->pressure, event.time);
  } else if (std::holds_alternative<PointerLeft>(event.what)) {
    pointer_inside_ = false;
  } else {
    let_go(event.time);
  }
  if (pressed_otherwise) retouch(event.time);
}

// The same place by another pressure or range.
void Desktop::retouch(TimePoint time) {
  if (work_) work_->touch(time, touch(), stream_);
}

void Desktop::let_go(TimePoint time) {
  held_.clear();
  modifiers_ = {};
  pen_pressure_ = 0.0;
  end_work(time);
  stream_.put_down(time);
  stream_.leave(time);
  holding_ = Holding::nothing;
  pointer_inside_ = false;
  corner_picked_ = false;
}

void Desktop::on_button(const ButtonChanged& button, const InputEvent& event, const DesktopWorld& world) {
  on_pointer(button.at_px, event.time, world);
  if (!button.down) {
    if (holding_ == Holding::nothing || button.button != holding_button_) return;
    end_work(event.time);
    holding_ = Holding::nothing;
    return;
  }
  if (taken_.pointer || holding_ != Holding::nothing || !world.camera_moves) return;
  holding_button_ = button.button;
  const bool space = held_.contains("Space");
  const bool shift = event.modifiers.shift;
  switch (button.button) {
    case PointerButton::left:
      if (space || !options_.hand) {
        begin_view(shift ? Holding::pan : Holding::orbit, world);
      } else {
        begin_work(event.time, world);
      }
      break;
    case PointerButton::middle:
      begin_view(Holding::pan, world);
      break;
    case PointerButton::right:
      begin_view(shift || !options_.hand ? Holding::pan : Holding::orbit, world);
      break;
  }
}

glm::dvec3 Desktop::under_pointer(const DesktopWorld& world) {
  const Eye eye = world.camera.eye(world.size.width_px, world.size.height_px);
  if (const auto over = picker_.pick(world.scene, eye, pointer_px_)) return over->at;
  const WorkPlane plane = work_plane(PlaneKind::screen, world.camera.target, eye);
  return meet(ray_through(eye, pointer_px_), plane).value_or(world.camera.target);
}

void Desktop::begin_view(Holding holding, const DesktopWorld& world) {
  holding_ = holding;
  pivot_ = under_pointer(world);
}

void Desktop::begin_work(TimePoint time, const DesktopWorld& world) {
  if (!hand_ready(time)) return;
  const Eye eye = world.camera.eye(world.size.width_px, world.size.height_px);
  const auto cursor = find_cursor(cursor_settings_, tool_, picker_, world.scene, eye, pointer_px_);
  if (!cursor) {
    on_refusal("there is no place under the pointer: turn the view or the work plane", time);
    return;
  }
  size_steps_ = 0;
  cursor_ = cursor;
  holding_ = Holding::work;
  work_ = PointerWork::begin(tool_, along_normal(), *cursor, {time, pointer_px_},
                             {cursor_settings_, picker_, world.scene, eye}, touch(), stream_);
}

void Desktop::end_work(TimePoint time) {
  if (!work_) return;
  const bool pen = tool_ == DesktopTool::draw || tool_ == DesktopTool::trim;
  bool more = pen && held_.contains("A");
  if (tool_ == DesktopTool::region) {
    // A tap picks one corner, and the next one the other; a drag picks both.
    const bool tap = work_->way_m() <= tap_m;
    more = tap && !corner_picked_;
    corner_picked_ = more;
  }
  work_->end(time, touch(), stream_, more ? HandStream::Ending::more : HandStream::Ending::whole);
  work_.reset();
}

void Desktop::on_pointer(const glm::dvec2& at_px, TimePoint time, const DesktopWorld& world) {
  const glm::dvec2 moved = at_px - pointer_px_;
  pointer_px_ = at_px;
  pointer_inside_ = true;
  if (moved == glm::dvec2(0.0)) return;
  switch (holding_) {
    case Holding::nothing:
      return;  // on_frame() looks where it is, once a frame.
    case Holding::orbit:
      orbit_about(world.camera, pivot_, moved, world.size);
      return;
    case Holding::pan:
      pan_with(world.camera, pivot_, moved, world.size);
      return;
    case Holding::work:
      break;
  }
  if (!work_) return;
  if (held_.contains("R") && work_->is_fist()) {
    turn_by_pointer(moved, time, world);
    return;
  }
  const Eye eye = world.camera.eye(world.size.width_px, world.size.height_px);
  work_->move({time, at_px}, {cursor_settings_, picker_, world.scene, eye}, touch(), stream_);
}

void Desktop::turn_by_pointer(const glm::dvec2& moved_px, TimePoint time, const DesktopWorld& world) {
  work_->skip(moved_px);
  const glm::dquat view =
      world.camera.eye(world.size.width_px, world.size.height_px).world_from_eye.orientation;
  const double scale = glm::pi<double>() / std::max(world.size.height_px, 1);
  const glm::dquat across = glm::angleAxis(moved_px.x * scale, view * glm::dvec3(0.0, 1.0, 0.0));
  const glm::dquat over = glm::angleAxis(moved_px.y * scale, view * glm::dvec3(1.0, 0.0, 0.0));
  work_->turn(time, across * over, stream_);
}

void Desktop::on_wheel(double steps, const InputEvent& event, const DesktopWorld& world) {
  if (!std::isfinite(steps)) return;
  if (event.modifiers.control && options_.hand) {
    change_range(steps, event.time);
  } else if (event.modifiers.shift && options_.hand) {
    base_pressure_ = std::clamp(base_pressure_ + steps * pressure_step, 0.0, 1.0);
  } else if (event.modifiers.alt && options_.hand) {
    const Eye eye = world.camera.eye(world.size.width_px, world.size.height_px);
    const WorkPlane plane = work_plane(cursor_settings_.plane, cursor_settings_.anchor, eye);
    cursor_settings_.anchor += std::clamp(steps, -20.0, 20.0) * plane_step_m * plane.normal;
  } else if (world.camera_moves) {
    zoom_to(world.camera, under_pointer(world), steps, world.size);
  }
}

void Desktop::change_range(double steps, TimePoint time) {
  const bool icon = work_ ? work_->holds_icon() : cursor_ && cursor_->over && !cursor_->over->icon.empty();
  if (tool_ == DesktopTool::move) {
    if (!work_) return;
    const int whole = static_cast<int>(std::lround(std::clamp(steps, -5.0, 5.0)));
    size_steps_ = std::clamp(size_steps_ + whole, -most_size_steps, most_size_steps);
  } else {
    double& changed = tool_ == DesktopTool::push && icon ? bend_ : range_;
    changed = std::clamp(changed + steps * range_step, 0.0, 1.0);
  }
  retouch(time);
}

void Desktop::on_key(const KeyChanged& key, const InputEvent& event, const DesktopWorld& world) {
  if (key.key.empty()) return;  // A modifier alone.
  if (!key.down) {
    held_.erase(key.key);
    if (key.key == "A" && !work_ && !corner_picked_) stream_.put_down(event.time);
    return;
  }
  if (taken_.keys) return;
  held_.insert(key.key);
  const auto command = command_of(key.key, event.modifiers);
  if (!command || (key.repeat && !repeats(command->action))) return;
  on_command(*command, event.time, world);
}

void Desktop::on_pressure(double pressure, TimePoint time) {
  pen_pressure_ = std::isfinite(pressure) ? std::clamp(pressure, 0.0, 1.0) : 0.0;
  retouch(time);
}

void Desktop::set_tool(DesktopTool tool, TimePoint time) {
  if (tool == tool_ || !options_.hand) return;
  end_work(time);
  stream_.put_down(time);
  corner_picked_ = false;
  tool_ = tool;
}

// What the panels' buttons and the keys call modes are tools here.
void Desktop::give(PaletteCommand command, TimePoint time) {
  const auto between = [&](DesktopTool one, DesktopTool other) {
    set_tool(tool_ == one ? other : one, time);
  };
  switch (command) {
    case PaletteCommand::move:
      between(DesktopTool::move, DesktopTool::push);
      return;
    case PaletteCommand::trim_mode:
      between(DesktopTool::trim, DesktopTool::draw);
      return;
    case PaletteCommand::icon_pen:
      between(DesktopTool::region, DesktopTool::draw);
      return;
    default:
      break;
  }
  if (hand_ready(time)) stream_.command(command);
}

void Desktop::on_command(const DesktopCommand& command, TimePoint time, const DesktopWorld& world) {
  const int tool = static_cast<int>(command.action) - static_cast<int>(DesktopAction::tool_lay);
  if (tool >= 0 && tool < static_cast<int>(desktop_tools)) {
    set_tool(static_cast<DesktopTool>(tool), time);
    return;
  }
  if (do_view(command.action, world) || !options_.hand || do_cursor(command.action, time, world)) return;
  switch (command.action) {
    case DesktopAction::pressure_up:
      base_pressure_ = std::min(1.0, base_pressure_ + pressure_step);
      break;
    case DesktopAction::pressure_down:
      base_pressure_ = std::max(0.0, base_pressure_ - pressure_step);
      break;
    case DesktopAction::range_up:
      change_range(1.0, time);
      break;
    case DesktopAction::range_down:
      change_range(-1.0, time);
      break;
    case DesktopAction::tap_thumb:
      stream_.tap_thumb(time);
      break;
    case DesktopAction::cancel:
      stream_.cancel(time);
      work_.reset();
      corner_picked_ = false;
      if (holding_ == Holding::work) holding_ = Holding::nothing;
      break;
    case DesktopAction::command:
      give(command.command, time);
      break;
    case DesktopAction::export_to:
      if (hand_ready(time)) {
        v1::Operation operation;
        operation.mutable_export_()->set_path(command.path);
        stream_.submit(std::move(operation));
      }
      break;
    default:
      turn(command.action, time, world);
      break;
  }
  retouch(time);
}

// Without something in hand the arrows turn the view.
void Desktop::turn(DesktopAction action, TimePoint time, const DesktopWorld& world) {
  const Eye eye = world.camera.eye(world.size.width_px, world.size.height_px);
  const glm::dquat& view = eye.world_from_eye.orientation;
  const glm::dvec3 up = view * glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 right = view * glm::dvec3(1.0, 0.0, 0.0);
  const bool in_hand = work_ && work_->is_fist();
  const auto by = [&](const glm::dvec3& axis, double sign, const glm::dvec2& view_px) {
    if (in_hand) {
      work_->turn(time, glm::angleAxis(sign * turn_step_rad, axis), stream_);
    } else if (view_px != glm::dvec2(0.0) && world.camera_moves) {
      orbit_about(world.camera, world.camera.target, view_px, world.size);
    }
  };
  const glm::dvec3 axis = work_ ? work_->axis() : up;
  switch (action) {
    case DesktopAction::turn_left:
      return by(axis, 1.0, {});
    case DesktopAction::turn_right:
      return by(axis, -1.0, {});
    case DesktopAction::lean_left:
      return by(up, -1.0, {-view_step_px, 0.0});
    case DesktopAction::lean_right:
      return by(up, 1.0, {view_step_px, 0.0});
    case DesktopAction::lean_up:
      return by(right, -1.0, {0.0, -view_step_px});
    case DesktopAction::lean_down:
      return by(right, 1.0, {0.0, view_step_px});
    default:
      return;
  }
}

bool Desktop::do_view(DesktopAction action, const DesktopWorld& world) {
  switch (action) {
    case DesktopAction::view_designer:
      world.camera.look(StandardView::perspective);
      return true;
    case DesktopAction::view_front:
      world.camera.look(StandardView::front);
      return true;
    case DesktopAction::view_top:
      world.camera.look(StandardView::top);
      return true;
    case DesktopAction::view_side:
      world.camera.look(StandardView::front);
      world.camera.azimuth_rad = 0.0;
      return true;
    case DesktopAction::frame_all:
      wishes_.frame_all = true;
      return true;
    case DesktopAction::frame_selected:
      wishes_.frame_selected = true;
      return true;
    case DesktopAction::toggle_head:
      wishes_.toggle_head = true;
      return true;
    case DesktopAction::toggle_distances:
      wishes_.toggle_distances = true;
      return true;
    case DesktopAction::toggle_zebra:
      wishes_.toggle_zebra = true;
      return true;
    case DesktopAction::next_light:
      wishes_.next_light = true;
      return true;
    case DesktopAction::next_lines:
      wishes_.next_lines = true;
      return true;
    case DesktopAction::save_picture:
      wishes_.save_picture = true;
      return true;
    case DesktopAction::toggle_help:
      wishes_.toggle_help = true;
      return true;
    case DesktopAction::close:
      wishes_.close = !work_;  // Control also means faint: not in the middle of a stroke.
      return true;
    default:
      return false;
  }
}

bool Desktop::do_cursor(DesktopAction action, TimePoint time, const DesktopWorld& world) {
  const Eye eye = world.camera.eye(world.size.width_px, world.size.height_px);
  CursorSettings& settings = cursor_settings_;
  const auto step_plane = [&](double sign) {
    settings.anchor += sign * plane_step_m * work_plane(settings.plane, settings.anchor, eye).normal;
  };
  switch (action) {
    case DesktopAction::next_plane:
      settings.plane = settings.plane == PlaneKind::screen
                           ? PlaneKind::table
                           : static_cast<PlaneKind>(static_cast<int>(settings.plane) + 1);
      return true;
    case DesktopAction::plane_here:
      if (const auto over = picker_.pick(world.scene, eye, pointer_px_)) {
        settings.anchor = over->at;
      } else {
        on_refusal("there is nothing under the pointer for the work plane to pass through", time);
      }
      return true;
    case DesktopAction::plane_nearer:
      step_plane(1.0);
      return true;
    case DesktopAction::plane_farther:
      step_plane(-1.0);
      return true;
    case DesktopAction::toggle_stick:
      of_tool(settings.sticks, tool_) = !state_.sticks;
      return true;
    case DesktopAction::toggle_snap:
      settings.snaps = !settings.snaps;
      return true;
    case DesktopAction::toggle_along:
      of_tool(along_, tool_) = !along_normal();
      return true;
    default:
      return false;
  }
}

}  // namespace handloft::client
