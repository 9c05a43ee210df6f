#pragma once
// One gesture of the pointer, from the press to the release: where the hand is while the pointer goes, for
// each kind of tool. What it begins with is frozen: a plane does not turn with the camera, nor a normal with
// the surface that it belonged to.
//
//   lay, draw, trim, region   the cursor, wherever the pointer goes
//   push                      begins on that side of the shape which the pointer then moves away from, 15 mm
//                             before it, and goes along the normal, or (`along_normal` off) in the work plane
//   push near an icon, move   what is held goes as far as the pointer does, along the normal or in the plane

#include <optional>

#include "client-hmd/desktop/cursor.h"
#include "client-hmd/desktop/hand_stream.h"

namespace handloft::client {

struct PointerPlace {
  TimePoint time;
  glm::dvec2 at_px{0.0};
};

/// What a gesture sees of the world; lives for one call.
struct PointerWorld {
  const CursorSettings& settings;
  Picker& picker;
  const Scene& scene;
  const Eye& eye;
};

class PointerWork {
 public:
  /// The button goes down at `cursor`.
  static PointerWork begin(DesktopTool tool, bool along_normal, const Cursor& cursor,
                           const PointerPlace& place, const PointerWorld& world, const HandTouch& touch,
                           HandStream& hand);

  /// The pointer goes on. Long ways are gone in steps, so that a path on a surface stays on it.
  void move(const PointerPlace& place, const PointerWorld& world, const HandTouch& touch, HandStream& hand);
  /// Other pressure or potentiometer, at the same place.
  void touch(TimePoint time, const HandTouch& touch, HandStream& hand);
  /// The hand turns by so much more, about its centre; only fists do.
  void turn(TimePoint time, const glm::dquat& by, HandStream& hand);
  /// The pointer has moved, but the hand is not to follow: it turned instead.
  void skip(const glm::dvec2& by_px);
  void end(TimePoint time, const HandTouch& touch, HandStream& hand, HandStream::Ending ending);

  DesktopTool tool() const { return tool_; }
  const glm::dvec3& at() const { return at_; }
  /// What keys turn about: the drag's direction.
  const glm::dvec3& axis() const { return axis_; }
  const WorkPlane& plane() const { return plane_; }
  bool holds_icon() const { return holds_icon_; }
  bool is_fist() const { return tool_ == DesktopTool::push || tool_ == DesktopTool::move; }
  /// How far the hand is from where it began, metres.
  double way_m() const { return glm::distance(at_, start_); }

 private:
  PointerWork() = default;
  std::optional<glm::dvec3> place_at(const glm::dvec2& at_px, const PointerWorld& world);
  void step_to(const PointerPlace& place, const PointerWorld& world, const HandTouch& touch,
               HandStream& hand);
  void begin_push(TimePoint time, const HandTouch& touch, HandStream& hand);

  DesktopTool tool_ = DesktopTool::lay;
  bool along_normal_ = false;
  bool holds_icon_ = false;
  bool begun_ = false;     ///< A push waits for the direction of the pointer's way.
  glm::dvec3 start_{0.0};  ///< Where the button went down.
  glm::dvec3 at_{0.0};
  glm::dvec3 axis_{0.0, 0.0, 1.0};
  WorkPlane plane_;
  glm::dvec2 start_px_{0.0};
  PointerPlace last_;
  glm::dquat turn_{1.0, 0.0, 0.0, 0.0};
};

}  // namespace handloft::client
