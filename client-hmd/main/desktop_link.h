#pragma once
// Between the desktop's hand and everything that it touches: the window's events go in, its messages go to
// the model server, its wishes to the picture.

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client-hmd/desktop/desktop.h"
#include "client-hmd/main/options.h"
#include "client-hmd/main/view_state.h"
#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/render/cursor_mark.h"
#include "client-hmd/render/frame.h"

namespace handloft::client {

/// What the frame loop itself has to do about the input.
struct InputWishes {
  bool end = false;
  bool screenshot = false;
  bool film = false;  ///< The camera follows the head from now on.
  bool help = false;  ///< The list of keys, shown or not.
};

/// One frame's input.
struct DesktopInput {
  const std::vector<InputEvent>& events;        ///< Without those that panels took.
  const std::vector<DesktopCommand>& commands;  ///< Of panels.
  InputTaken taken;                             ///< By panels, after these events.
  PictureSize size;
  TimePoint now;
};

class DesktopLink {
 public:
  explicit DesktopLink(const HmdOptions& options);

  /// Never waits: what the server does not take is dropped, and told.
  InputWishes handle(const DesktopInput& input, ModelFeed& feed, ViewState& view);

  /// For panels.
  const DesktopState& state() const { return desktop_.state(); }
  /// Adds the cursor, and the disk of a push that has not begun.
  void add_to(Frame& frame) const;

 private:
  void send(ModelFeed& feed, const ModelState& model, TimePoint now);
  InputWishes apply(const DesktopWishes& wishes, const Scene& scene, PictureSize size, ViewState& view);

  Desktop desktop_;
  std::deque<HandMessage> outbox_;
  std::uint64_t client_id_ = 0;  ///< Of the connection that the outbox is for.
};

/// Who joins the model server by these options: an editor where there is to be a hand.
FeedOptions feed_options(const HmdOptions& options);

}  // namespace handloft::client
