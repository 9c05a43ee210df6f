#include "daemon-tracking/main/options.h"

#include <string>

#include "daemon-tracking/main/exit_status.h"

namespace handloft::tracking {

OptionTable make_option_table(DaemonOptions& options) {
  OptionTable table("handloft-trackd",
                    "Tracks head and hand with cameras and a glove, and publishes poses and gestures.\n" +
                        std::string(exit_status_words));
  table.add("listen", options.listen, "Where subscribers connect; default: this user's runtime folder",
            {.value_name = "ENDPOINT"});
  table.add("simulate", options.simulate,
            "A simulated rig: a hand that designs a mouse shell, does all that hands can do, sculpts, follows "
            "strokes or a recorded hand",
            {.choices = {"mouse", "tour", "sculpt", "strokes", "motion"}});
  table.add("strokes", options.strokes, "The strokes that the simulated hand follows",
            {.value_name = "FILE.tilt"});
  table.add("motion", options.motion, "The recorded fingertips that the simulated hand follows",
            {.value_name = "FILE.tsv"});
  table.add("motion_s", options.motion_s, "No more of the motion than so many seconds",
            {.min = 1, .max = 3600});
  table.add("replay", options.replay, "Play a recording through the same code", {.value_name = "FILE"});
  table.add("record", options.record, "Record all that the devices say", {.value_name = "FILE"});
  table.add("report", options.report, "Write figures on the session as JSON when it ends",
            {.value_name = "FILE"});
  table.add("pace", options.pace, "How fast samples come: simulations by default in real time, replays fast",
            {.choices = {"default", "real-time", "fast"}});
  table.add("seed", options.seed, "Of the simulated rig's noise and timing");
  table.add("camera_rate_hz", options.camera_rate_hz, "Frames a second of the simulated cameras",
            {.min = 5, .max = 120});
  table.add("wait_for_subscribers", options.wait_for_subscribers, "Begin when so many have subscribed",
            {.min = 0, .max = 64});
  table.add("wait_timeout_s", options.wait_timeout_s, "But give up after this many seconds",
            {.min = 0, .max = 3600});
  table.add("exit_at_end", options.exit_at_end, "End when the simulation or the recording does");
  table.add("video", options.video, "Offer the cameras' pictures to viewers in shared memory");
  table.add("log_level", options.log_level, "What is logged on standard error",
            {.choices = {"trace", "debug", "info", "warning", "error", "off"}});
  return table;
}

Status check(const DaemonOptions& options) {
  const auto refuse = [](const char* field, const char* message) {
    return make_error(ErrorCode::invalid_argument, message, field);
  };
  if (options.simulate && options.replay)
    return refuse("replay", "found together with --simulate, expected one of them");
  if (!options.simulate && !options.replay) {
    return refuse(
        "simulate",
        "no source of samples: expected --simulate mouse, tour, strokes or motion, or --replay FILE");
  }
  if (options.strokes && options.simulate != "strokes")
    return refuse("strokes", "expected only with --simulate strokes");
  if (options.simulate == "strokes" && !options.strokes)
    return refuse("strokes", "--simulate strokes needs a .tilt file");
  if (options.motion && options.simulate != "motion")
    return refuse("motion", "expected only with --simulate motion");
  if (options.simulate == "motion" && !options.motion)
    return refuse("motion", "--simulate motion needs a motion capture's .tsv file");
  if (options.record && options.record == options.replay) {
    return refuse("record", "found the file that is being replayed, expected another one");
  }
  return {};
}

}  // namespace handloft::tracking
