// The right column's first page, what people share: named versions, and comments with their answers (U6).

#include <algorithm>

#include "client-hmd/hud/panel_parts.h"
#include "client-hmd/hud/words.h"

namespace handloft::client {
namespace {

constexpr std::size_t longest_name = 24;

/// A text and what sends it; true: it is to be sent.
bool line_and_button(PanelParts& parts, const std::string& name, const char* hint, std::string_view label,
                     std::string& text, const std::string& reason) {
  text_field(parts, name + "-text", hint, text);
  const std::string why = !reason.empty() ? reason : text.empty() ? "Type the words first" : "";
  return text_button(parts, name, label, ButtonLook::plain, ImGui::GetContentRegionAvail().x, why);
}

std::string selected_shape(const PanelContents& contents) {
  const auto found = std::find_if(contents.shapes.begin(), contents.shapes.end(),
                                  [](const ShapeRow& row) { return row.selected; });
  return found == contents.shapes.end() ? std::string() : found->id;
}

/// The pin as in the picture: a number on a disc, with a rim.
void pin(PanelParts& parts, const CommentRow& row) {
  const GuiFonts& fonts = parts.gui.fonts();
  const float diameter = 1.3F * parts.em;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const ImVec2 centre{at.x + 0.5F * diameter, at.y + 0.5F * diameter};
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddCircleFilled(centre, 0.5F * diameter, colour(row.colour, row.resolved ? 0.35F : 1.0F), 24);
  list.AddCircle(centre, 0.5F * diameter, colour(parts.theme.ink, 0.55F), 24);
  const std::string number = row.resolved ? "-" : std::to_string(row.number);
  const ImVec2 size = fonts.small->CalcTextSizeA(fonts.small->FontSize, 1e6F, 0.0F, number.c_str());
  // Dark on light and light on dark, whoever's colour it is.
  const auto channel = [&row](unsigned shift) {
    return static_cast<float>(row.colour >> shift & 0xFFU) / 255.0F;
  };
  const float light = 0.2126F * channel(16) + 0.7152F * channel(8) + 0.0722F * channel(0);
  constexpr std::uint32_t black = 0x101010, white = 0xFFFFFF;
  list.AddText(fonts.small, fonts.small->FontSize, {centre.x - 0.5F * size.x, centre.y - 0.5F * size.y},
               colour(light > 0.45F ? black : white), number.c_str());
  ImGui::Dummy({diameter, diameter});
  ImGui::SameLine(0.0F, 0.45F * parts.em);
}

void comment(PanelParts& parts, const CommentRow& row, const std::string& watching) {
  ImGui::PushID(row.id.c_str());
  pin(parts, row);
  ImGui::BeginGroup();
  small_words(parts, row.about, parts.theme.faint_ink);
  words(parts, row.text, row.resolved ? parts.theme.disabled_ink : parts.theme.ink);
  for (const std::string& reply : row.replies) small_words(parts, "↳ " + reply, parts.theme.ink);
  ImGui::EndGroup();
  if (parts.memory.replying == row.id) {
    if (line_and_button(parts, "reply-send:" + row.id, "Your answer", "Answer", parts.memory.reply,
                        watching)) {
      parts.ask(ReplyTo{row.id, parts.memory.reply});
      parts.memory.replying.clear();
      parts.memory.reply.clear();
    }
  } else {
    const float width = tile_width(3);
    if (text_button(parts, "reply:" + row.id, "Answer", ButtonLook::plain, width, watching)) {
      parts.memory.replying = row.id;
      parts.memory.reply.clear();
    }
    ImGui::SameLine();
    if (text_button(parts, "resolve:" + row.id, row.resolved ? "Reopen" : "Resolve", ButtonLook::plain, width,
                    watching)) {
      parts.ask(ResolveComment{row.id, !row.resolved});
    }
    ImGui::SameLine();
    // Whose it is, the server knows best: it refuses in words.
    if (text_button(parts, "delete-comment:" + row.id, "Delete", ButtonLook::plain, width, watching)) {
      parts.ask(DeleteRemark{row.id});
    }
  }
  gap(parts, 0.25F);
  ImGui::PopID();
}

/// What was done since that version, as far as it is known.
void draw_difference(PanelParts& parts, const std::string& version) {
  const std::optional<VersionDifference>& found = parts.contents.difference;
  if (!found || found->from != version || found->asking) {
    small_words(parts, "Comparing…", parts.theme.faint_ink);
    return;
  }
  const std::string until = found->to.empty() ? "now" : "“" + found->to + "”";
  small_words(parts, "From this version to " + until + ":", parts.theme.faint_ink);
  if (!found->refusal.empty()) {
    small_words(parts, "⚠ " + found->refusal, parts.theme.bad_ink);
  } else if (found->sentences.empty()) {
    small_words(parts, "Nothing has changed.", parts.theme.ink);
  }
  for (const std::string& sentence : found->sentences) small_words(parts, "· " + sentence, parts.theme.ink);
  note_place(parts, "difference:" + version);
}

void version_buttons(PanelParts& parts, const NamedVersion& version, const std::string& watching) {
  const float width = tile_width(2);
  const std::string& name = version.name;
  if (text_button(parts, "restore:" + name, "↶ Restore", ButtonLook::plain, width, watching))
    parts.ask(RestoreNamed{name});
  ImGui::SameLine();
  if (text_button(parts, "branch:" + name, "Branch", ButtonLook::plain, width, watching))
    parts.ask(BranchFrom{name});
  if (text_button(parts, "compare:" + name, "Compare", ButtonLook::plain, width)) {
    parts.memory.compared_version = name;
    parts.ask(CompareVersions{name, {}});
  }
  ImGui::SameLine();
  const std::string not_owner = parts.contents.is_owner ? "" : "Only an owner of the model deletes versions";
  if (text_button(parts, "delete-version:" + name, "Delete", ButtonLook::plain, width,
                  watching.empty() ? not_owner : watching)) {
    parts.ask(DeleteNamed{name});
  }
}

/// Buttons that compare `from` with the versions after it instead of with the present.
void compare_with_others(PanelParts& parts, const std::string& from) {
  bool after = false;
  for (const NamedVersion& version : parts.contents.versions) {
    if (after &&
        text_button(parts, "compare-with:" + version.name, "… with " + shortened(version.name, longest_name),
                    ButtonLook::plain, ImGui::GetContentRegionAvail().x)) {
      parts.ask(CompareVersions{from, version.name});
    }
    after = after || version.name == from;
  }
}

void version_row(PanelParts& parts, const NamedVersion& version, const std::string& watching) {
  PanelMemory& memory = parts.memory;
  ImGui::PushID(version.name.c_str());
  const bool open = memory.opened_version == version.name;
  if (choice_row(parts, "version:" + version.name, shortened(version.name, longest_name),
                 open ? Chosen::yes : Chosen::no)) {
    memory.opened_version = open ? std::string() : version.name;
  }
  if (open) {
    const std::string about = (version.author.empty() ? std::string() : version.author) +
                              (version.author.empty() || version.note.empty() ? "" : ": ") + version.note;
    if (!about.empty()) small_words(parts, about, parts.theme.faint_ink);
    version_buttons(parts, version, watching);
    if (memory.compared_version == version.name) {
      compare_with_others(parts, version.name);
      draw_difference(parts, version.name);
    }
    gap(parts, 0.25F);
  }
  ImGui::PopID();
}

}  // namespace

void draw_comments(PanelParts& parts) {
  heading(parts, "Comments");
  const std::string watching = parts.contents.can_comment ? "" : "You are watching";
  for (const CommentRow& row : parts.contents.comments) comment(parts, row, watching);
  const std::string shape = selected_shape(parts.contents);
  if (line_and_button(parts, "comment", shape.empty() ? "A comment" : "A comment on the selected shape",
                      "Pin it", parts.memory.comment, watching)) {
    parts.ask(CommentOn{shape, parts.memory.comment});
    parts.memory.comment.clear();
  }
}

void draw_versions(PanelParts& parts) {
  heading(parts, "Versions");
  const std::string watching = parts.contents.can_edit ? "" : "You are watching";
  for (const NamedVersion& version : parts.contents.versions) version_row(parts, version, watching);
  if (line_and_button(parts, "version-name", "Name of this version", "Keep this version",
                      parts.memory.version, watching)) {
    parts.ask(KeepVersion{parts.memory.version});
    parts.memory.version.clear();
  }
}

}  // namespace handloft::client
