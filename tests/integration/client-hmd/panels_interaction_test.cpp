// The panels do what they say when they are clicked and typed at, by events as a window makes them (V6, V7).

#include <gmock/gmock.h>

#include "tests/integration/client-hmd/panels_fixture.h"

namespace handloft::client::test {
namespace {

using testing::ElementsAre;

class PanelsAtWork : public PanelsOverPicture {
 protected:
  void SetUp() override {
    PanelsOverPicture::SetUp();
    ASSERT_TRUE(target_.resize(width_, height_).ok());
  }
  void begin() {
    make_panels();
    frame();
    frame();
    frame();
    requests_.clear();
  }
};

TEST_F(PanelsAtWork, GiveTheCommandsOfTheirButtons_V7) {
  begin();
  click("command:fit");
  click("command:symmetry");
  click("undo");
  EXPECT_THAT(given(), ElementsAre(PaletteCommand::fit, PaletteCommand::symmetry, PaletteCommand::undo));
  click("tool:push");
  ASSERT_EQ(asked<DesktopCommand>().size(), 4U);
  EXPECT_EQ(asked<DesktopCommand>().back().action, DesktopAction::tool_push);
}

TEST_F(PanelsAtWork, SayWhyInsteadOfDoingWhatCannotBeDone_V7) {
  scene_ = std::make_shared<Scene>();
  begin();
  click("command:fit");
  EXPECT_THAT(given(), testing::IsEmpty());
  EXPECT_TRUE(panels_->place_of("notice:0").has_value());
  click("notice:0");
  EXPECT_FALSE(panels_->place_of("notice:0").has_value()) << "put away by a click";
}

TEST_F(PanelsAtWork, TakeWhatIsOverThemAndLeaveTheRestToTheWork_V6) {
  begin();
  const glm::dvec2 over = middle_of("command:fit"), free(640.0, 400.0);
  EXPECT_TRUE(event(PointerMoved{over}));
  EXPECT_TRUE(event(WheelTurned{1.0}));
  EXPECT_TRUE(event(ButtonChanged{PointerButton::left, true, over}));
  EXPECT_TRUE(event(PointerMoved{free})) << "the panel's drag goes on outside of it";
  EXPECT_TRUE(event(ButtonChanged{PointerButton::left, false, free}));
  EXPECT_FALSE(event(PointerMoved{free}));
  EXPECT_FALSE(event(WheelTurned{1.0}));
  EXPECT_FALSE(event(ButtonChanged{PointerButton::right, true, free}));
  EXPECT_FALSE(event(PointerMoved{over})) << "the work's drag goes on over a panel";
  EXPECT_FALSE(event(ButtonChanged{PointerButton::right, false, over}));
  EXPECT_TRUE(event(PointerMoved{over}));
  EXPECT_FALSE(event(KeyChanged{"F", true, false})) << "keys are the work's";
}

TEST_F(PanelsAtWork, DoNotMissAClickWithinOneFrame) {
  begin();
  const glm::dvec2 over = middle_of("command:fit");
  event(PointerMoved{over});
  event(ButtonChanged{PointerButton::left, true, over});
  event(ButtonChanged{PointerButton::left, false, over});
  for (int i = 0; i < 4; ++i) frame();
  EXPECT_THAT(given(), ElementsAre(PaletteCommand::fit));
  EXPECT_FALSE(panels_->has_more_input());
}

TEST_F(PanelsAtWork, ShowRenameAndDeleteShapes_V7) {
  begin();
  click("show:Surface");
  ASSERT_EQ(asked<ShowShape>().size(), 1U);
  EXPECT_EQ(asked<ShowShape>()[0].id, "top");
  EXPECT_EQ(asked<ShowShape>()[0].representation, Representation::surface);
  click("rename");
  key("A", {.shift = false, .control = true, .alt = false});
  type("Left wing 2");
  EXPECT_TRUE(event(KeyChanged{"F", true, false})) << "the field has the keyboard";
  event(KeyChanged{"F", false, false});
  key("Backspace");
  frame();
  click("name-keep");
  ASSERT_EQ(asked<RenameShape>().size(), 1U);
  EXPECT_EQ(asked<RenameShape>()[0].name, "Left wing 2");
  EXPECT_FALSE(event(KeyChanged{"F", true, false})) << "and gives it back";
  click("delete");
  ASSERT_EQ(asked<DeleteShape>().size(), 1U);
  EXPECT_EQ(asked<DeleteShape>()[0].id, "top");
}

TEST_F(PanelsAtWork, SelectTheShapeOfARow_V7) {
  begin();
  click("shape:shape-2");
  EXPECT_THAT(given(), ElementsAre(PaletteCommand::select_next));
}

TEST_F(PanelsAtWork, ChangeWhatIsSeen_V3_V7) {
  begin();
  click("page:view");
  EXPECT_EQ(panels_->page(), PanelPage::view);
  click("shading:zebra");
  click("overlay:wires");
  ASSERT_EQ(asked<ChangeView>().size(), 2U);
  EXPECT_EQ(asked<ChangeView>()[0].choices.shading, Shading::zebra);
  EXPECT_TRUE(asked<ChangeView>()[1].choices.overlays.wires);
  click("page:view");
  EXPECT_FALSE(panels_->layout().right_open) << "its button folds it, too";
}

TEST_F(PanelsAtWork, ChangeSettingsAtOnceAndAskToKeepThem_V7) {
  begin();
  const float before = panels_->layout().bar.size.y;
  click("page:settings");
  click("text-larger");
  click("text-larger");
  click("colours:high-contrast");
  EXPECT_EQ(panels_->settings().text_percent, 120);
  EXPECT_GT(panels_->layout().bar.size.y, before);
  ASSERT_FALSE(asked<ChangeSettings>().empty());
  EXPECT_EQ(asked<ChangeSettings>().back().settings, panels_->settings());
  EXPECT_EQ(panels_->settings().colours, ColourScheme::high_contrast);
}

TEST_F(PanelsAtWork, FoldAndOpenColumns) {
  begin();
  click("fold:left");
  EXPECT_FALSE(panels_->layout().left_open);
  EXPECT_FALSE(panels_->covers({100.0, 400.0})) << "the room is the work's";
  click("open:left");
  EXPECT_TRUE(panels_->layout().left_open);
}

TEST_F(PanelsAtWork, AreWorkedByKeysAlone_V7) {
  begin();
  EXPECT_TRUE(event(KeyChanged{"F6", true, false}));
  event(KeyChanged{"F6", false, false});
  frame();
  EXPECT_TRUE(event(KeyChanged{"Down", true, false})) << "keys are the panels' now";
  event(KeyChanged{"Down", false, false});
  frame();
  EXPECT_TRUE(event(KeyChanged{"Escape", true, false}));
  EXPECT_FALSE(event(KeyChanged{"Down", true, false}));
}

TEST_F(PanelsAtWork, FindKeysAndCommandsInTheHelp_V7) {
  begin();
  key("F1");
  EXPECT_EQ(panels_->page(), PanelPage::help);
  frame();
  const float whole = panels_->place_of("panel:right")->size.y;
  click("help-search");
  type("mirrors");
  frame();
  EXPECT_LT(panels_->place_of("panel:right")->size.y, 0.5F * whole) << "only what was sought";
  key("F1");
  EXPECT_FALSE(panels_->layout().right_open);
}

TEST_F(PanelsAtWork, LeadThroughTheTour_V6) {
  settings_.tour_done = false;
  scene_ = std::make_shared<Scene>();
  begin();
  EXPECT_TRUE(panels_->place_of("card:tour").has_value());
  scene_ = shell_scene();
  frame();
  EXPECT_EQ(panels_->tour().step(), TourStep::fit) << "points are there";
  click("tour:skip");
  click("tour:skip");
  click("tour:skip");
  EXPECT_EQ(panels_->tour().step(), TourStep::finish);
  panels_->tell_export("Exported \"Shell\" to shell.step", now_);
  frame();
  frame();
  EXPECT_EQ(panels_->tour().state(), Tour::State::finished);
  EXPECT_TRUE(panels_->settings().tour_done);
  click("tour:dismiss");
  EXPECT_FALSE(panels_->place_of("card:tour").has_value());
  click("page:settings");
  click("tour:repeat");
  frame();
  EXPECT_EQ(panels_->tour().step(), TourStep::lay);
  click("tour:end");
  EXPECT_TRUE(panels_->settings().tour_done);
  EXPECT_FALSE(panels_->place_of("card:tour").has_value());
}

TEST_F(PanelsAtWork, WatchWithoutAHandOfTheirOwn_V7) {
  desktop_.available = false;
  begin();
  click("command:new_shape");
  click("tool:push");
  click("delete");
  EXPECT_THAT(requests_, testing::IsEmpty());
}

class PanelsOfATeam : public PanelsAtWork {
 protected:
  void SetUp() override {
    width_ = 1280;
    height_ = 1400;  // Everything of the page is to be seen.
    PanelsAtWork::SetUp();
    model_.own_client_id = 2;
    model_.role = v1::ROLE_OWNER;
    scene_->versions = std::make_shared<const std::vector<NamedVersion>>(std::vector<NamedVersion>{
        {"first", "", "Mira", 0, "round"}, {"second", "softer", "Jonas", 0, "round"}});
    PinnedComment flat;
    flat.id = "c-1";
    flat.text = "Too flat.";
    flat.entity = "shape-2";
    flat.author = "Mira";
    flat.client_id = 3;
    scene_->comments = std::make_shared<const std::vector<PinnedComment>>(std::vector{flat});
  }
};

TEST_F(PanelsOfATeam, KeepRestoreBranchAndDeleteVersions_U6) {
  begin();
  click("version-name");
  EXPECT_TRUE(asked<KeepVersion>().empty()) << "a version needs a name";
  click("version-name-text");
  type("For the client");
  click("version-name");
  ASSERT_EQ(asked<KeepVersion>().size(), 1U);
  EXPECT_EQ(asked<KeepVersion>()[0].name, "For the client");
  EXPECT_FALSE(panels_->place_of("restore:first").has_value());
  click("version:first");
  click("restore:first");
  click("branch:first");
  click("delete-version:first");
  ASSERT_EQ(asked<RestoreNamed>().size(), 1U);
  EXPECT_EQ(asked<RestoreNamed>()[0].version, "first");
  ASSERT_EQ(asked<BranchFrom>().size(), 1U);
  EXPECT_EQ(asked<BranchFrom>()[0].version, "first");
  ASSERT_EQ(asked<DeleteNamed>().size(), 1U);
  EXPECT_EQ(asked<DeleteNamed>()[0].version, "first");
  click("version:first");
  EXPECT_FALSE(panels_->place_of("restore:first").has_value()) << "folded again";
}

TEST_F(PanelsOfATeam, LetOnlyOwnersDeleteVersionsAndSaySo_U2) {
  model_.role = v1::ROLE_EDITOR;
  begin();
  click("version:first");
  click("delete-version:first");
  EXPECT_TRUE(asked<DeleteNamed>().empty());
  EXPECT_TRUE(panels_->place_of("notice:0").has_value()) << "it says why";
}

TEST_F(PanelsOfATeam, CompareVersionsInWords_U6) {
  begin();
  click("version:first");
  click("compare:first");
  ASSERT_EQ(asked<CompareVersions>().size(), 1U);
  EXPECT_EQ(asked<CompareVersions>()[0].from, "first");
  EXPECT_EQ(asked<CompareVersions>()[0].to, "");
  EXPECT_FALSE(panels_->place_of("difference:first").has_value()) << "not answered yet";
  model_.difference = VersionDifference{"first", "", false, {"Mira moved Grip by 12 mm."}, ""};
  frame();
  frame();
  ASSERT_TRUE(panels_->place_of("difference:first").has_value());
  EXPECT_FALSE(panels_->place_of("compare-with:first").has_value()) << "with what came before";
  click("compare-with:second");
  ASSERT_EQ(asked<CompareVersions>().size(), 2U);
  EXPECT_EQ(asked<CompareVersions>()[1].from, "first");
  EXPECT_EQ(asked<CompareVersions>()[1].to, "second");
}

TEST_F(PanelsOfATeam, CommentAnswerResolveAndDelete_U6) {
  begin();
  click("comment-text");
  type("Round it");
  click("comment");
  ASSERT_EQ(asked<CommentOn>().size(), 1U);
  EXPECT_EQ(asked<CommentOn>()[0].entity, "top") << "the selected shape";
  EXPECT_EQ(asked<CommentOn>()[0].text, "Round it");
  click("reply:c-1");
  click("reply-send:c-1-text");
  type("Yes");
  click("reply-send:c-1");
  ASSERT_EQ(asked<ReplyTo>().size(), 1U);
  EXPECT_EQ(asked<ReplyTo>()[0].comment, "c-1");
  EXPECT_EQ(asked<ReplyTo>()[0].text, "Yes");
  click("resolve:c-1");
  ASSERT_EQ(asked<ResolveComment>().size(), 1U);
  EXPECT_TRUE(asked<ResolveComment>()[0].resolved);
  click("delete-comment:c-1");
  ASSERT_EQ(asked<DeleteRemark>().size(), 1U);
  EXPECT_EQ(asked<DeleteRemark>()[0].comment, "c-1");
}

TEST_F(PanelsOfATeam, AskNothingForWhoeverMayNotAndSayWhy_U2) {
  desktop_.available = false;
  model_.role = v1::ROLE_COMMENTER;
  begin();
  click("version:first");
  click("restore:first");
  EXPECT_TRUE(asked<RestoreNamed>().empty());
  EXPECT_TRUE(panels_->place_of("notice:0").has_value());
  click("resolve:c-1");
  EXPECT_EQ(asked<ResolveComment>().size(), 1U) << "a commenter comments";
  model_.role = v1::ROLE_VIEWER;
  frame();
  click("resolve:c-1");
  EXPECT_EQ(asked<ResolveComment>().size(), 1U) << "a viewer does not";
}

TEST_F(PanelsAtWork, SurviveWhatPeopleAndServersCallThings) {
  scene_->alternatives = {"", {"", "##", "%s%n", std::string(5000, 'x')}};
  for (auto& [id, entity] : scene_->entities) {
    auto changed = std::make_shared<Entity>(*entity);
    changed->name = "%s %n ## \xff\xfe " + std::string(3000, 'w');
    entity = changed;
  }
  scene_->history = {4'000'000'000U, 4'000'000'000U, "%s%s%s", "\xf0\x28\x8c\x28", "", ""};
  for (std::uint64_t id = 1; id < 60; ++id) person(id, "Somebody with quite a long name", "%n");
  begin();
  panels_->tell(NoticeKind::warning, "%n%s \xff", now_);
  for (const auto& [width, height] : {std::pair{1, 1}, std::pair{800, 500}, std::pair{3840, 100}}) {
    width_ = width;
    height_ = height;
    ASSERT_TRUE(target_.resize(width, height).ok());
    frame();
    frame();
  }
}

}  // namespace
}  // namespace handloft::client::test
