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

TEST_F(PanelsOverPicture, LookAsTheyShallDuringTheTour_V6_V7) {
  settings_.tour_done = false;
  scene_ = std::make_shared<Scene>();
  expect_golden(picture(1280, 720), "client_panels_tour");
}

}  // namespace
}  // namespace handloft::client::test
