// Requests to a session wake who waits for them; none is lost or seen twice.

#include "daemon-tracking/main/session_control.h"

#include <gtest/gtest.h>

#include <future>

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;
using Wake = SessionControl::Wake;

TEST(SessionControl, WaitingEndsWithARequest) {
  for (const Wake wanted : {Wake::stop, Wake::reload, Wake::end}) {
    SessionControl control;
    auto waiting = std::async(std::launch::async, [&] { return control.wait(); });
    if (wanted == Wake::stop) control.stop();
    if (wanted == Wake::reload) control.reload();
    if (wanted == Wake::end) control.note_end();
    EXPECT_EQ(waiting.get(), wanted);
  }
}

TEST(SessionControl, WithoutOneTheTimeIsUp) {
  const SessionControl control;
  EXPECT_EQ(control.wait(1ms), Wake::timeout);
  EXPECT_EQ(control.wait_for_request(0ms), Wake::timeout);
}

TEST(SessionControl, AReloadIsTakenOnceAndStopsWin) {
  SessionControl control;
  control.reload();
  control.reload();
  EXPECT_EQ(control.wait(), Wake::reload);
  EXPECT_TRUE(control.take_reload());
  EXPECT_FALSE(control.take_reload());
  control.reload();
  control.stop();
  EXPECT_EQ(control.wait(), Wake::stop);
  EXPECT_TRUE(control.stopping());
}

TEST(SessionControl, TheEndOfEarlierSourcesIsForgotten) {
  SessionControl control;
  control.note_end();
  EXPECT_EQ(control.wait_for_request(0ms), Wake::timeout) << "no request";
  control.begin();
  EXPECT_EQ(control.wait(0ms), Wake::timeout);
}

}  // namespace
}  // namespace handloft::tracking
