#include "server-model/session/hand_source.h"

#include <algorithm>

namespace handloft::session {

void add_marks(const interaction::Interaction& interaction, stream::HandMarks& marks) {
  if (std::string active = interaction.active_shape(); !active.empty()) {
    marks.active.push_back(std::move(active));
  }
  for (std::string& target : interaction.targets()) marks.targets.push_back(std::move(target));
  using From = interaction::IconMark::Kind;
  using To = stream::IconMark::Kind;
  for (const interaction::IconMark& mark : interaction.icon_marks()) {
    const stream::IconMark added{mark.name.entity, mark.name.icon,
                                 mark.kind == From::held ? To::held : To::target};
    const bool told = std::find(marks.icons.begin(), marks.icons.end(), added) != marks.icons.end();
    if (!told) marks.icons.push_back(added);
  }
}

}  // namespace handloft::session
