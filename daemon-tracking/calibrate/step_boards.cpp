// intrinsics and extrinsics.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "daemon-tracking/calibrate/seen_tags.h"
#include "daemon-tracking/calibrate/steps.h"
#include "daemon-tracking/calibration/extrinsics.h"
#include "daemon-tracking/calibration/intrinsics.h"
#include "daemon-tracking/calibration/picture.h"
#include "daemon-tracking/calibration/trajectory.h"

namespace handloft::tracking {
namespace {

namespace fs = std::filesystem;

/// Residuals are drawn so much larger than they are.
constexpr double residual_zoom = 30.0;
/// A table camera that stands still sees the same corners at the end as at the beginning.
constexpr double stands_still_px = 0.7;
constexpr double max_motion_px = 0.5;
/// Head poses needed before clocks are compared.
constexpr std::size_t fewest_moving_sights = 60;
/// Frames between two guesses at what other board is shown.
constexpr std::size_t guess_every = 40;

Status draw_intrinsics(const StepContext& context, const std::string& name, const Plane& last,
                       const std::vector<BoardView>& views, const IntrinsicsCalibration& made) {
  Picture picture(last);
  for (std::size_t i = 0; i < made.used.size(); ++i) {
    const BoardView& view = views[made.used[i]];
    for (std::size_t c = 0; c < view.corners.size(); ++c) {
      picture.circle(view.corners[c].pixel, 1.5, ink::good);
      picture.line(view.corners[c].pixel, view.corners[c].pixel - residual_zoom * made.residuals[i][c],
                   ink::bad);
    }
  }
  picture.text({8, 18}, fmt::format("{}: corners used; red: what is left, {} times", name, residual_zoom),
               ink::note);
  picture.text({8, picture.height_px() - 10.0}, made.result.words, ink::white, 11);
  if (const Status saved =
          picture.save(fs::path(context.options.out) / fmt::format("intrinsics-{}.png", name));
      !saved)
    return saved;

  Picture map(last.width_px, last.height_px, ink::white);
  const Eigen::Vector2d field(static_cast<double>(last.width_px) / coverage_columns,
                              static_cast<double>(last.height_px) / coverage_rows);
  for (int row = 0; row < coverage_rows; ++row) {
    for (int column = 0; column < coverage_columns; ++column) {
      const int corners = made.field_corners[coverage_field(column, row)];
      const double full = std::min(1.0, corners / 30.0);
      const Ink colour =
          corners == 0 ? ink::bad : Ink{0.9 - 0.8 * full, 0.95 - 0.25 * full, 0.9 - 0.8 * full, 1};
      const Eigen::Vector2d at(column * field.x(), row * field.y());
      map.fill(at, field - Eigen::Vector2d(2, 2), colour);
      map.text(at + Eigen::Vector2d(6, 18), fmt::format("{}", corners), ink::white);
    }
  }
  return map.save(fs::path(context.options.out) / fmt::format("coverage-{}.png", name));
}

struct BoardSights {
  std::vector<BoardView> views;
  Plane last;
  std::size_t frames = 0;
  int width_px = 0, height_px = 0;
  std::optional<ChessboardShape> other;  ///< Another board than the expected one.
};

/// A pinhole whose half-way tag corners are known: what the file gets of a camera's device.
void note_devices(StepContext& context, const Input& input) {
  for (const auto& [camera, device] : input.devices) context.calibration.cameras[camera].device = device;
}

std::string nothing_seen(const std::string& name, const BoardSights& sights,
                         const CalibrateOptions& options) {
  if (options.board == "charuco")
    return fmt::format(
        "'{}' saw no ChArUco board of {} x {} inner corners with markers {} in {} frames: are --columns, "
        "--rows and "
        "--dictionary those of the board?",
        name, options.columns, options.rows, options.dictionary, sights.frames);
  if (options.board == "table")
    return fmt::format("'{}' saw no tag of the table in {} frames", name, sights.frames);
  std::string words = fmt::format("'{}' saw no chessboard of {} x {} inner corners in {} frames", name,
                                  options.columns, options.rows, sights.frames);
  if (sights.other)
    words +=
        fmt::format(", but one of {} x {}: is it the right board? Say --columns {} --rows {}",
                    sights.other->columns, sights.other->rows, sights.other->columns, sights.other->rows);
  else
    words += ": hold it up as a whole, with its white rim, in good light";
  return words;
}

}  // namespace

Result<Verdict> run_intrinsics(StepContext& context) {
  const CalibrateOptions& options = context.options;
  const Board board = options.intrinsics_board(context.calibration.rig.table_tags);
  auto finder = BoardFinder::create(board);
  if (!finder) return finder.error();
  auto input = open_input(options, context.calibration);
  if (!input) return input.error();
  std::map<std::uint32_t, BoardSights> cameras;
  const auto count =
      for_each_frame(*input, options, context.calibration, DecodePlanes::luma, context.terminal,
                     [&](const CameraFrame& frame, const PlanarImage& image, const std::string& name) {
                       BoardSights& to = cameras[frame.camera];
                       to.width_px = frame.width_px;
                       to.height_px = frame.height_px;
                       auto view = finder->find(image.y, frame.camera, frame.capture_time, name);
                       if (view)
                         to.views.push_back(std::move(*view));
                       else if (board.chessboard && !to.other && to.frames % guess_every == 0)
                         to.other = guess_chessboard(image.y);
                       ++to.frames;
                       to.last = image.y;
                     });
  if (!count) return count.error();
  if (cameras.empty())
    return make_error(ErrorCode::failed_precondition, "no frame of a camera came", "intrinsics");
  Verdict worst = Verdict::good;
  std::optional<Error> refused;
  for (const auto& [camera, sights] : cameras) {
    const std::string& name = context.calibration.rig.cameras[camera].name;
    if (context.terminal != nullptr)
      fmt::print(context.terminal, "{}: the board was seen in {} of {} frames.\n", name, sights.views.size(),
                 sights.frames);
    Result<IntrinsicsCalibration> made =
        make_error(ErrorCode::failed_precondition, nothing_seen(name, sights, options), "intrinsics");
    if (!sights.views.empty()) {
      IntrinsicsOptions limits;
      if (options.board == "table") limits.min_corners = 16;
      made = calibrate_intrinsics(sights.views, sights.width_px, sights.height_px, limits);
    }
    if (!made) {
      refused = made.error();
      refused->field = fmt::format("intrinsics.{}", name);
      if (context.terminal != nullptr)
        fmt::print(context.terminal, "{}: refused. {}\n", name, made.error().message);
      continue;
    }
    std::size_t left_out = 0;
    for (const ViewReport& view : made->views) {
      if (view.refused.empty()) continue;
      constexpr std::size_t most_named = 5;
      if (++left_out <= most_named && context.terminal != nullptr)
        fmt::print(context.terminal, "  left out {}: {}\n", sights.views[view.view].source, view.refused);
    }
    if (left_out > 0 && context.terminal != nullptr)
      fmt::print(context.terminal, "  {} views were left out in all.\n", left_out);
    tell(context, name, made->result);
    if (const Status drawn = draw_intrinsics(context, name, sights.last, sights.views, *made); !drawn)
      return drawn.error();
    made->result.date = context.date;
    worst = std::max(worst, made->result.verdict);
    if (made->result.verdict == Verdict::bad) continue;
    context.calibration.rig.cameras[camera].intrinsics = made->lens;
    context.calibration.cameras[camera].results["intrinsics"] = made->result;
  }
  if (refused) return *refused;
  note_devices(context, *input);
  return worst;
}

namespace {

Status draw_extrinsics(const StepContext& context, const Rig& rig, std::uint32_t camera, const Plane& last,
                       const BoardView& table) {
  const CameraCalibration& calibration = rig.cameras[camera];
  Picture picture(last);
  for (const CornerMeasurement& corner : table.corners) picture.circle(corner.pixel, 3, ink::good);
  for (const TagPlacement& tag : rig.table_tags) {
    const auto corners = tag_corners(tag);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto a =
          project_through(calibration.intrinsics, calibration.world_from_camera.inverse() * corners[i]);
      const auto b = project_through(calibration.intrinsics,
                                     calibration.world_from_camera.inverse() * corners[(i + 1) % 4]);
      if (a && b) picture.line(a->pixel, b->pixel, ink::bad);
    }
  }
  picture.text(
      {8, 18},
      fmt::format("{}: green seen, red where the calibration puts the table's tags", calibration.name),
      ink::note);
  return picture.save(fs::path(context.options.out) / fmt::format("extrinsics-{}.png", calibration.name));
}

/// What the cameras' clocks differ by, if a head was moved before them.
Verdict find_clocks(StepContext& context, const Rig& rig, std::vector<TagSight> sights) {
  std::erase_if(sights,
                [&](const TagSight& sight) { return rig.cameras[sight.camera].role == CameraRole::head; });
  TrajectoryInput input{rig.cameras, rig.head_tags, rig.table_tags, std::move(sights)};
  TrajectoryOptions options;
  options.row_times = context.options.row_times ? Estimate::find : Estimate::keep;
  const auto made = calibrate_on_the_move(input, options);
  if (!made) {
    if (context.terminal != nullptr)
      fmt::print(context.terminal, "clocks: not compared. {}\n", made.error().message);
    return Verdict::usable;
  }
  Verdict worst = Verdict::good;
  for (std::size_t i = 0; i < made->cameras.size(); ++i) {
    const CameraTiming& timing = made->cameras[i];
    if (timing.corners == 0) continue;
    StepResult result = timing.result;
    tell(context, fmt::format("{}'s clock", rig.cameras[i].name), result);
    result.date = context.date;
    worst = std::max(worst, result.verdict);
    if (result.verdict == Verdict::bad) continue;
    CameraCalibration& camera = context.calibration.rig.cameras[i];
    if (worth_using(timing)) camera.time_offset += from_seconds(timing.offset_s);
    context.calibration.cameras[i].results["time"] = result;
    if (context.options.row_times) context.calibration.rig.cameras[i].row_time = from_seconds(timing.row_s);
  }
  // A clock that could not be compared keeps its offset: that is no reason to throw the poses away.
  return worst == Verdict::bad ? Verdict::usable : worst;
}

}  // namespace

Result<Verdict> run_extrinsics(StepContext& context) {
  const CalibrateOptions& options = context.options;
  Rig& rig = context.calibration.rig;
  auto finder = BoardFinder::create(options.extrinsics_board());
  if (!finder) return finder.error();
  auto tags = SeenTags::create(rig);
  if (!tags) return tags.error();
  auto input = open_input(options, context.calibration);
  if (!input) return input.error();

  std::vector<BoardView> board;
  std::map<std::uint32_t, std::vector<BoardView>> table;
  std::map<std::uint32_t, Plane> last;
  std::optional<Error> wrong_size;
  const auto count =
      for_each_frame(*input, options, context.calibration, DecodePlanes::luma, context.terminal,
                     [&](const CameraFrame& frame, const PlanarImage& image, const std::string& name) {
                       const CameraCalibration& camera = rig.cameras[frame.camera];
                       if (camera.role != CameraRole::table) return;
                       const DeviceIdentity same = context.calibration.cameras[frame.camera].device;
                       if (const Status fits = check_device(context.calibration, frame.camera, same,
                                                            frame.width_px, frame.height_px);
                           !fits) {
                         wrong_size = fits.error();
                         return;
                       }
                       const TagSight& sight = tags->look(frame, image.y);
                       BoardView seen = table_view(rig, sight, name);
                       if (!seen.ids.empty()) table[frame.camera].push_back(std::move(seen));
                       // A frame full of tags shows no chessboard, and looking for one takes its time.
                       if (auto view = finder->find(image.y, frame.camera, frame.capture_time, name))
                         board.push_back(std::move(*view));
                       last[frame.camera] = image.y;
                     });
  if (!count) return count.error();
  if (wrong_size) return *wrong_size;

  ExtrinsicsInput known;
  std::vector<std::uint32_t> rig_index;
  std::map<std::uint32_t, std::uint32_t> local;
  for (std::uint32_t i = 0; i < rig.cameras.size(); ++i) {
    if (rig.cameras[i].role != CameraRole::table || !wants_camera(options, rig.cameras[i].name)) continue;
    local[i] = static_cast<std::uint32_t>(rig_index.size());
    rig_index.push_back(i);
    known.names.push_back(rig.cameras[i].name);
    known.lenses.push_back(rig.cameras[i].intrinsics);
  }
  for (auto& [camera, views] : table) {
    const auto middle = views.begin() + static_cast<std::ptrdiff_t>(views.size() / 2);
    const std::size_t often = std::min<std::size_t>(5, std::max<std::size_t>(1, views.size() / 4));
    const BoardView first = still_view({views.begin(), middle}, 1e9, 1),
                    second = still_view({middle, views.end()}, 1e9, 1);
    for (std::size_t i = 0; i < first.ids.size(); ++i) {
      const auto at = std::find(second.ids.begin(), second.ids.end(), first.ids[i]);
      if (at == second.ids.end()) continue;
      const double moved =
          (first.corners[i].pixel - second.corners[static_cast<std::size_t>(at - second.ids.begin())].pixel)
              .norm();
      if (moved > stands_still_px)
        return make_error(ErrorCode::failed_precondition,
                          fmt::format("'{}' or the table was moved while it watched: a corner went {:.1f} "
                                      "px. Fix both and do it again",
                                      rig.cameras[camera].name, moved),
                          "extrinsics");
    }
    BoardView still = still_view(views, 1e9, often);
    still.camera = local[camera];
    known.table_views.push_back(std::move(still));
  }
  for (BoardView& view : board) {
    view.camera = local[view.camera];
    known.views.push_back(std::move(view));
  }
  MomentOptions moments;
  moments.max_motion_px = max_motion_px;
  known.moments = shared_moments(known.views, moments);
  known.table_tags = rig.table_tags;
  if (context.terminal != nullptr)
    fmt::print(
        context.terminal,
        "{} cameras saw the table's tags; the chessboard was held still before two or more in {} places.\n",
        known.table_views.size(), known.moments.size());
  if (known.table_views.empty() && context.terminal != nullptr)
    fmt::print(context.terminal,
               "No tag of the table was seen: the world is the chessboard where it was first seen by two "
               "cameras.\n");

  ExtrinsicsOptions limits;
  limits.print = options.table_print();
  auto made = calibrate_extrinsics(known, limits);
  if (!made) return made.error();
  for (const ViewReport& view : made->refused)
    if (context.terminal != nullptr) fmt::print(context.terminal, "  left out {}\n", view.refused);
  Verdict worst = Verdict::good;
  Rig found = rig;
  found.table_tags = made->table_tags;
  for (std::size_t i = 0; i < rig_index.size(); ++i) {
    tell(context, known.names[i], made->results[i]);
    worst = std::max(worst, made->results[i].verdict);
    found.cameras[rig_index[i]].world_from_camera = made->world_from_camera[i];
  }
  for (const auto& [camera, plane] : last) {
    BoardView seen;
    for (const BoardView& view : known.table_views)
      if (view.camera == local[camera]) seen = view;
    if (const Status drawn = draw_extrinsics(context, found, camera, plane, seen); !drawn)
      return drawn.error();
  }
  if (worst == Verdict::bad) return worst;
  rig = found;
  for (std::size_t i = 0; i < rig_index.size(); ++i) {
    made->results[i].date = context.date;
    context.calibration.cameras[rig_index[i]].results["extrinsics"] = made->results[i];
  }
  note_devices(context, *input);
  if (tags->sights().size() >= fewest_moving_sights && !options.images)
    worst = std::max(worst, find_clocks(context, found, tags->sights()));
  return worst;
}

}  // namespace handloft::tracking
