// What the panels say of the state of things (V7).

#include "client-hmd/hud/panel_contents.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "client-hmd/desktop/key_map.h"
#include "client-hmd/hud/selection_seeker.h"
#include "client-hmd/hud/shortcuts.h"
#include "client-hmd/hud/words.h"

namespace handloft::client {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class PanelWords : public testing::Test {
 protected:
  PanelWords() {
    model_.connected = true;
    model_.snapshots = 1;
    model_.own_client_id = 5;
    desktop_.available = true;
    scene_->epoch = 1;
  }
  PanelFacts facts() {
    model_.scene = scene_;
    return {.model = model_,
            .tracking = tracking_,
            .tracking_wanted = tracking_wanted_,
            .lag = lag_,
            .latency_ms = latency_ms_,
            .frames_per_second = 0.0,
            .desktop = desktop_,
            .view = {},
            .colours = ColourScheme::normal,
            .keys = key_help()};
  }
  PanelContents contents() {
    trail_.follow(*scene_);
    return panel_contents(facts(), trail_);
  }
  std::string states() {
    std::string all;
    for (const StateWords& state : contents().states) all += state.words + "|";
    for (const StateWords& state : contents().figures) all += state.words + "|";
    return all;
  }
  Entity& add(const std::string& id, EntityKind kind = EntityKind::dual_shape) {
    auto entity = std::make_shared<Entity>();
    entity->id = entity->name = id;
    entity->kind = kind;
    scene_->entities[id] = entity;
    return *entity;
  }

  std::shared_ptr<Scene> scene_ = std::make_shared<Scene>();
  ModelState model_;
  TrackingStatus tracking_;
  DesktopState desktop_;
  HistoryTrail trail_;
  bool tracking_wanted_ = false;
  std::optional<Duration> lag_;
  double latency_ms_ = 0.0;
};

TEST_F(PanelWords, SayHowTheConnectionsAre_V5_V7) {
  EXPECT_THAT(states(), HasSubstr("Live|Mouse and keyboard"));
  tracking_wanted_ = true;
  EXPECT_THAT(states(), HasSubstr("No tracking"));
  tracking_.connected = true;
  EXPECT_THAT(states(), HasSubstr("Live|Tracking"));
  desktop_.available = false;
  EXPECT_THAT(states(), HasSubstr("watching"));
  model_.connected = false;
  EXPECT_THAT(states(), HasSubstr("Reconnecting"));
  model_.snapshots = 0;
  EXPECT_THAT(states(), HasSubstr("Connecting"));
}

TEST_F(PanelWords, TellLagBeforeEverythingElse_V5) {
  latency_ms_ = 34.2;
  lag_ = std::chrono::milliseconds(249);
  EXPECT_EQ(contents().figures.front().words, "34 ms latency");
  lag_ = std::chrono::milliseconds(1300);
  EXPECT_EQ(contents().figures.front().words, "1.3 s behind");
  EXPECT_EQ(contents().figures.front().tone, Tone::bad);
  EXPECT_FALSE(contents().figures.front().sign.empty()) << "not told by colour alone";
}

TEST_F(PanelWords, NameWhoIsHereOnceEach_U1) {
  const auto hand = [this](std::uint64_t id, const std::string& name, const std::string& label,
                           const std::string& tool) {
    Activity activity;
    activity.client_id = id;
    activity.name = name;
    activity.tool = tool;
    model_.activities[{id, label}] = activity;
  };
  hand(0, "hand", "hand", "fit");
  hand(5, "Me", "Me", "laying points");
  hand(7, "Mira", "Mira", "");
  hand(7, "Mira", "Mira 2", "pushing");
  hand(8, "", "", "");
  const std::vector<Person> people = contents().people;
  ASSERT_EQ(people.size(), 2U);
  EXPECT_EQ(people[0].name, "Mira");
  EXPECT_EQ(people[0].doing, "pushing");
  EXPECT_EQ(people[0].colour, user_colour(7, ColourScheme::normal));
  EXPECT_EQ(people[1].name, "Somebody");
}

TEST_F(PanelWords, CallNothingSavedThatIsNotOnTheDisk_U5) {
  scene_->sequence = 10;
  EXPECT_THAT(states(), Not(HasSubstr("Sav"))) << "nothing is told";
  scene_->storage = {.told = true, .kept = true, .durable_sequence = 9, .problem = {}};
  EXPECT_THAT(states(), HasSubstr("Saving|"));
  scene_->storage.durable_sequence = 10;
  EXPECT_THAT(states(), HasSubstr("Saved|"));
  scene_->storage.kept = false;
  EXPECT_THAT(states(), HasSubstr("Not kept"));
  scene_->storage.problem = "the disk is full";
  EXPECT_THAT(states(), HasSubstr("Not saved: the disk is full"));
  scene_->storage = {.told = true, .kept = true, .durable_sequence = 10, .problem = {}};
  model_.connected = false;
  EXPECT_THAT(states(), Not(HasSubstr("Saved"))) << "what became of it meanwhile is not known";
}

TEST_F(PanelWords, TellWhatTheViewerRefused_V5) {
  model_.refusal = "entities[0].points: found NaN";
  EXPECT_EQ(contents().figures.front().words, "Refused: entities[0].points: found NaN");
  EXPECT_EQ(contents().figures.front().tone, Tone::bad);
}

TEST_F(PanelWords, NameEverybodyWithTheirRoles_U1_U2) {
  model_.people = std::make_shared<const std::vector<PersonHere>>(std::vector<PersonHere>{
      {5, "me", "Me", "owner"}, {7, "mira", "Mira", "editor"}, {9, "bo", "", "viewer"}});
  Activity activity;
  activity.client_id = 7;
  activity.tool = "pushing";
  model_.activities[{7, "Mira"}] = activity;
  const std::vector<Person> people = contents().people;
  ASSERT_EQ(people.size(), 2U);
  EXPECT_EQ(people[0].name, "Mira");
  EXPECT_EQ(people[0].role, "editor");
  EXPECT_EQ(people[0].doing, "pushing");
  EXPECT_EQ(people[1].name, "bo") << "who only looks is here, too";
  EXPECT_EQ(people[1].role, "viewer");
}

TEST_F(PanelWords, NumberCommentsAsTheirPinsAre_U6) {
  add("seat").name = "Seat";
  const auto comment = [](std::string id, std::string text, std::string reply_to, bool resolved) {
    PinnedComment one;
    one.id = std::move(id);
    one.text = std::move(text);
    one.reply_to = std::move(reply_to);
    one.resolved = resolved;
    one.author = "Ann";
    one.entity = "seat";
    return one;
  };
  scene_->comments = std::make_shared<const std::vector<PinnedComment>>(
      std::vector{comment("a", "done", "", true), comment("b", "too flat", "", false),
                  comment("c", "softer?", "", false), comment("d", "yes", "b", false)});
  const std::vector<CommentRow> rows = contents().comments;
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].text, "too flat");
  EXPECT_EQ(rows[0].number, 1);
  EXPECT_EQ(rows[0].about, "Ann on Seat");
  EXPECT_THAT(rows[0].replies, testing::ElementsAre("Ann: yes"));
  EXPECT_EQ(rows[1].number, 2);
  EXPECT_TRUE(rows[2].resolved);
  EXPECT_EQ(rows[2].number, 0) << "it has no pin";
  const auto open = open_threads(*scene_->comments);
  for (std::size_t i = 0; i < open.size(); ++i) EXPECT_EQ(open[i]->text, rows[i].text);
}

TEST_F(PanelWords, SayWhyUndoWouldBeRefusedAndWhoHoldsAShape_U1) {
  Entity& shape = add("shape-1");
  scene_->history.undo_steps = 1;
  EXPECT_THAT(why_not(PaletteCommand::undo, facts()), IsEmpty());
  scene_->history.undo_refused = "Mira has changed the shape since";
  EXPECT_EQ(why_not(PaletteCommand::undo, facts()), "Mira has changed the shape since");
  shape.leased_by = 7;
  shape.leased_by_name = "Mira";
  EXPECT_EQ(contents().shapes[0].by, "Mira");
  shape.leased_by = 5;
  EXPECT_EQ(contents().shapes[0].by, "you");
}

TEST_F(PanelWords, HaveEveryCommandInOneSection_V7) {
  std::map<PaletteCommand, int> seen;
  for (const CommandSection& section : contents().sections) {
    EXPECT_FALSE(section.buttons.empty()) << section.title;
    for (const CommandButton& button : section.buttons) {
      ++seen[button.command];
      EXPECT_EQ(section_of(button.command), section.title);
      EXPECT_FALSE(command_help(button.command).empty()) << button.label;
      EXPECT_LE(command_help(button.command).size(), 90U) << button.label;
    }
  }
  for (const PaletteCell& cell : table_palette) {
    const int wanted = cell.command == PaletteCommand::next_page ? 0 : 1;
    EXPECT_EQ(seen[cell.command], wanted) << cell.label;
  }
}

TEST_F(PanelWords, SayWhyACommandIsNotToBeHad_V7) {
  EXPECT_THAT(why_not(PaletteCommand::undo, facts()), HasSubstr("nothing to undo"));
  EXPECT_THAT(why_not(PaletteCommand::fit, facts()), HasSubstr("no shape"));
  EXPECT_THAT(why_not(PaletteCommand::export_file, facts()), HasSubstr("nothing to export"));
  EXPECT_THAT(why_not(PaletteCommand::next_alternative, facts()), HasSubstr("only one"));
  EXPECT_THAT(why_not(PaletteCommand::icon_state, facts()), HasSubstr("no icon"));
  EXPECT_THAT(why_not(PaletteCommand::new_shape, facts()), IsEmpty());
  Entity& shape = add("shape-1");
  shape.selected = true;
  EXPECT_THAT(why_not(PaletteCommand::fit, facts()), IsEmpty());
  EXPECT_THAT(why_not(PaletteCommand::representation, facts()), HasSubstr("not fitted"));
  shape.surface = std::make_shared<SurfaceMesh>();
  EXPECT_THAT(why_not(PaletteCommand::representation, facts()), IsEmpty());
  scene_->history.undo_steps = 1;
  EXPECT_THAT(why_not(PaletteCommand::undo, facts()), IsEmpty());
  EXPECT_THAT(why_not(PaletteCommand::redo, facts()), HasSubstr("nothing to redo"));
  desktop_.available = false;
  EXPECT_THAT(why_not(PaletteCommand::undo, facts()), HasSubstr("watching"));
  model_.connected = false;
  EXPECT_THAT(why_not(PaletteCommand::undo, facts()), HasSubstr("server"));
}

TEST_F(PanelWords, DescribeShapes_V7) {
  Entity& shape = add("shape-1");
  auto points = std::make_shared<PointSet>();
  points->points.resize(1204);
  shape.points = points;
  EXPECT_EQ(contents().shapes[0].details, "1,204 points · not fitted");
  EXPECT_FALSE(contents().shapes[0].representable);
  shape.surface = std::make_shared<SurfaceMesh>();
  shape.residual_rms_m = 0.00031;
  EXPECT_EQ(contents().shapes[0].details, "1,204 points · RMS 0.31 mm");
  EXPECT_TRUE(contents().shapes[0].representable);
  shape.residual_rms_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(contents().shapes[0].details, "1,204 points");
  shape.provisional = true;
  shape.provisional_by = 7;
  EXPECT_EQ(contents().shapes[0].by, "somebody");
  shape.provisional_by = 5;
  EXPECT_EQ(contents().shapes[0].by, "you");
  add("reference-1", EntityKind::reference);
  EXPECT_FALSE(contents().shapes[0].selectable) << "reference-1 comes first, and hands do not change it";
}

TEST_F(PanelWords, ShowGaugesOfTheHandThatWorks) {
  desktop_.pressure = 0.62;
  desktop_.range = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(contents().pressure->words, "62 %");
  EXPECT_EQ(contents().range->words, "0 %");
  tracking_.hand = HandStatus{v1::GESTURE_CLOSED, 0.25, true, true, 80};
  EXPECT_EQ(contents().pressure->words, "25 %");
  EXPECT_TRUE(contents().pressure->active);
  EXPECT_EQ(contents().gesture, "Closed hand");
}

TEST(HistoryTrail, RemembersTheNamesThatPassedBy) {
  HistoryTrail trail;
  Scene scene;
  scene.epoch = 1;
  scene.history = {2, 0, "Fit", "", "", ""};
  trail.follow(scene);
  EXPECT_THAT(trail.rows().undo, testing::ElementsAre("Fit")) << "what was before is not known";
  scene.history = {3, 0, "Push", "", "", ""};
  trail.follow(scene);
  EXPECT_THAT(trail.rows().undo, testing::ElementsAre("Push", "Fit"));
  scene.history = {2, 1, "Fit", "Push", "", ""};
  trail.follow(scene);
  EXPECT_THAT(trail.rows().undo, testing::ElementsAre("Fit"));
  EXPECT_THAT(trail.rows().redo, testing::ElementsAre("Push"));
  scene.history = {3, 0, "Trim", "", "", ""};
  trail.follow(scene);
  EXPECT_THAT(trail.rows().undo, testing::ElementsAre("Trim", "Fit"));
  EXPECT_THAT(trail.rows().redo, testing::IsEmpty());
  scene.epoch = 2;
  scene.history = {1, 0, "Lay", "", "", ""};
  trail.follow(scene);
  EXPECT_THAT(trail.rows().undo, testing::ElementsAre("Lay"));
  scene.history = {4'000'000'000U, 0, "Far", "", "", ""};
  trail.follow(scene);
  EXPECT_EQ(trail.rows().undo_steps, 4'000'000'000U);
  EXPECT_LE(trail.rows().undo.size(), HistoryTrail::longest) << "whatever a server counts";
}

TEST(SelectionSeeker, StepsUntilTheShapeIsSelected) {
  Scene scene;
  const auto put = [&scene](const std::string& id, bool selected) {
    auto entity = std::make_shared<Entity>();
    entity->id = id;
    entity->selected = selected;
    scene.entities[id] = entity;
  };
  for (const char* id : {"a", "b", "c"}) put(id, false);
  SelectionSeeker seeker;
  TimePoint now{std::chrono::seconds(1)};
  EXPECT_FALSE(seeker.step(scene, now)) << "nothing is sought";
  seeker.seek("b");
  EXPECT_TRUE(seeker.step(scene, now));
  EXPECT_FALSE(seeker.step(scene, now)) << "not before the first is seen";
  put("a", true);
  EXPECT_TRUE(seeker.step(scene, now));
  put("a", false);
  put("b", true);
  EXPECT_FALSE(seeker.step(scene, now));
  EXPECT_FALSE(seeker.seeking());

  seeker.seek("gone");
  EXPECT_FALSE(seeker.step(scene, now));
  EXPECT_FALSE(seeker.seeking());

  seeker.seek("c");
  EXPECT_TRUE(seeker.step(scene, now));
  now += std::chrono::seconds(2);
  EXPECT_FALSE(seeker.step(scene, now)) << "the server does not answer";
  EXPECT_FALSE(seeker.seeking());
}

TEST(Shortcuts, AreWhatTheKeyboardHas) {
  EXPECT_EQ(shortcut_of(PaletteCommand::undo), "Ctrl+Z");
  EXPECT_EQ(shortcut_of(PaletteCommand::fit), "Enter");
  EXPECT_EQ(shortcut_of(PaletteCommand::refit_plane), "⇧P");
  EXPECT_EQ(shortcut_of(DesktopAction::tool_lay), "1");
  EXPECT_EQ(shortcut_of(PaletteCommand::next_page), "");
}

TEST(Words, AreShort) {
  EXPECT_EQ(plural(1, "point"), "1 point");
  EXPECT_EQ(plural(0, "point"), "0 points");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1000), "1,000");
  EXPECT_EQ(grouped(1234567), "1,234,567");
  EXPECT_EQ(shortened("Größe", 3), "Gr…") << "cut between characters";
  EXPECT_TRUE(contains_words("Undo the last step", "LAST"));
  EXPECT_FALSE(contains_words("Undo", "redo"));
  EXPECT_TRUE(contains_words("", ""));
}

}  // namespace
}  // namespace handloft::client
