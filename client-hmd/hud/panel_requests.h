#pragma once
// What somebody asked for by a panel. The panels change nothing themselves: whoever owns them acts.

#include <string>
#include <variant>

#include "client-hmd/desktop/desktop_state.h"
#include "client-hmd/hud/settings.h"
#include "client-hmd/hud/view_choices.h"
#include "client-hmd/mirror/scene.h"

namespace handloft::client {

struct RenameShape {
  std::string id, name;
};
struct DeleteShape {
  std::string id;
};
struct ShowShape {
  std::string id;
  Representation representation = Representation::points;
};
struct SwitchAlternative {
  std::string name;
};
/// Pinned to the shape; without one to the table.
struct CommentOn {
  std::string entity;
  std::string text;
};
struct ReplyTo {
  std::string comment;
  std::string text;
};
struct ResolveComment {
  std::string id;
  bool resolved = true;
};
struct DeleteRemark {
  std::string comment;
};
struct KeepVersion {
  std::string name;
};
struct RestoreNamed {
  std::string version;
};
/// A new alternative that begins as that version was.
struct BranchFrom {
  std::string version;
};
struct DeleteNamed {
  std::string version;
};
/// What was done from one version to another, in words.
struct CompareVersions {
  std::string from;
  std::string to;  ///< Empty: the present.
};
struct ChangeView {
  ViewChoices choices;
};
struct ChangeSettings {
  HudSettings settings;  ///< Already in effect; to be kept.
};

using PanelRequest = std::variant<DesktopCommand, RenameShape, DeleteShape, ShowShape, SwitchAlternative,
                                  CommentOn, ReplyTo, ResolveComment, DeleteRemark, KeepVersion, RestoreNamed,
                                  BranchFrom, DeleteNamed, CompareVersions, ChangeView, ChangeSettings>;

}  // namespace handloft::client
