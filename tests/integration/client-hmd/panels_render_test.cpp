// What the panels look like (V7): golden pictures at three sizes and in the schemes.

#include "tests/integration/client-hmd/panels_fixture.h"

namespace handloft::client::test {
namespace {

TEST_F(PanelsOverPicture, LookAsTheyShall_V7) {
  person(3, "Mira", "laying points");
  person(4, "Jonas", "");
  expect_golden(picture(1280, 720), "client_panels_1280x720");
}

TEST_F(PanelsOverPicture, LookAsTheyShallInASmallWindow_V7) {
  person(3, "Mira", "laying points");
  expect_golden(picture(800, 500), "client_panels_800x500");
}

TEST_F(PanelsOverPicture, LookAsTheyShallOnALargeScreen_V7) {
  person(3, "Mira", "laying points");
  make_panels();
  panels_->open(PanelPage::view);
  view_.shading = Shading::curvature;
  panels_->tell(NoticeKind::refused, "Fit: shape \"Grip\" has 4 points, expected at least 6", now_);
  panels_->tell_export("Exported \"Shell\" to designs/shell.step", now_);
  expect_golden(picture(1920, 1200), "client_panels_1920x1200");
}

TEST_F(PanelsOverPicture, LookAsTheyShallInHighContrast_V7) {
  settings_.colours = ColourScheme::high_contrast;
  person(3, "Mira", "laying points");
  make_panels();
  panels_->open(PanelPage::settings);
  panels_->tell(NoticeKind::refused, "Fit: shape \"Grip\" has 4 points, expected at least 6", now_);
  expect_golden(picture(1280, 720), "client_panels_high_contrast");
}

TEST_F(PanelsOverPicture, LookAsTheyShallWithLargeText_V7) {
  settings_.text_percent = 180;
  settings_.colours = ColourScheme::colour_blind_safe;
  make_panels();
  panels_->open(PanelPage::help);
  expect_golden(picture(1600, 900), "client_panels_large_text");
}

TEST_F(PanelsOverPicture, LookAsTheyShallWhileSeveralWork_U1_U5_U6) {
  model_.own_client_id = 2;
  model_.role = v1::ROLE_EDITOR;
  person(3, "Mira", "laying points");
  model_.people = std::make_shared<const std::vector<PersonHere>>(std::vector<PersonHere>{
      {2, "me", "Me", "editor"}, {3, "mira", "Mira", "editor"}, {4, "jonas", "Jonas", "viewer"}});
  scene_->storage = {.told = true, .kept = true, .durable_sequence = 1204, .problem = {}};
  scene_->history.undo_refused = "Mira has changed the shape since";
  auto grip = std::make_shared<Entity>(*scene_->entities["shape-2"]);
  grip->leased_by = 3;
  grip->leased_by_name = "Mira";
  scene_->entities["shape-2"] = grip;
  PinnedComment flat, answer, done;
  flat.id = "a";
  flat.text = "The thumb rest is too flat here.";
  flat.entity = "shape-2";
  flat.author = "Mira";
  flat.client_id = 3;
  answer.id = "b";
  answer.text = "3 mm more?";
  answer.reply_to = "a";
  answer.author = "Jonas";
  done.id = "c";
  done.text = "Edge is sharp.";
  done.resolved = true;
  done.author = "Jonas";
  done.client_id = 4;
  scene_->comments = std::make_shared<const std::vector<PinnedComment>>(std::vector{flat, answer, done});
  scene_->versions = std::make_shared<const std::vector<NamedVersion>>(std::vector<NamedVersion>{
      {"For the client", "", "Mira", 0, "round"}, {"Second try", "", "Jonas", 0, "edgy"}});
  expect_golden(picture(1280, 1200), "client_panels_together");
}

TEST_F(PanelsOverPicture, LookAsTheyShallWithVersionsCompared_U6) {
  model_.own_client_id = 2;
  model_.role = v1::ROLE_EDITOR;
  scene_->versions = std::make_shared<const std::vector<NamedVersion>>(std::vector<NamedVersion>{
      {"For the client", "before the meeting", "Mira", 0, "round"}, {"Second try", "", "Jonas", 0, "edgy"}});
  model_.difference = VersionDifference{
      "For the client", "", false, {"Mira moved Grip by 12 mm.", "40 points were added to Shell."}, ""};
  (void)picture(1280, 1200);
  click("version:For the client");
  click("compare:For the client");
  expect_golden(picture(1280, 1200), "client_panels_compared");
}

TEST_F(PanelsOverPicture, LookAsTheyShallWithTheSmallestText_V7) {
  settings_.text_percent = 80;
  person(3, "Mira", "laying points");
  expect_golden(picture(1280, 720), "client_panels_smallest_text");
}

TEST_F(PanelsOverPicture, LookAsTheyShallWithTheLargestText_V7) {
  settings_.text_percent = 250;
  expect_golden(picture(1920, 1200), "client_panels_largest_text");
}

TEST_F(PanelsOverPicture, LookAsTheyShallDuringTheTour_V6_V7) {
  settings_.tour_done = false;
  scene_ = std::make_shared<Scene>();
  expect_golden(picture(1280, 720), "client_panels_tour");
}

}  // namespace
}  // namespace handloft::client::test
