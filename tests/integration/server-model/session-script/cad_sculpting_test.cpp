// Every B-spline face of the models that Open CASCADE ships (Debian package occt-misc) imports, is sculpted
// by one icon, exports, and is valid on re-import (issue: it must show), by the operations that people use.
// What nobody sculpted comes out as it went in.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server-model/exchange/cad_import.h"
#include "server-model/exchange/step_reader.h"
#include "server-model/geometry/trim_region.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/sculpt_place.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/session/local_target.h"
#include "tests/support/test_data.h"

namespace handloft::model {
namespace {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;
using geometry::BSplineSurface;
using geometry::Vec2;
using geometry::Vec3;

constexpr const char* data_folder = "/usr/share/opencascade/data";  // Of the package occt-misc.
constexpr double pull = 0.02;                                       ///< Of the face's size, along its normal.
constexpr double written_m = 1e-9;  ///< Fifteen digits of a metre, and IGES's own rounding.
constexpr double same_area = 1e-6;  ///< Of areas in two formats, relative.
constexpr int looks = 7;            ///< Along each side of a surface, when two are compared.

bool is_iges(const fs::path& path) {
  return path.extension() == ".igs" || path.extension() == ".iges";
}

std::vector<fs::path> cad_files() {
  std::vector<fs::path> found;
  std::error_code failed;
  for (const auto& entry : fs::recursive_directory_iterator(data_folder, failed)) {
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (std::set<std::string>{".step", ".stp", ".iges", ".igs"}.contains(extension)) {
      found.push_back(entry.path());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

using Looks = std::array<Vec3, static_cast<std::size_t>(looks* looks)>;

/// Places of a surface over a grid in its parameters, whatever their unit.
Looks look_at(const BSplineSurface& surface) {
  Looks places;
  for (int i = 0; i < looks; ++i) {
    for (int j = 0; j < looks; ++j) {
      places[static_cast<std::size_t>(i * looks + j)] =
          surface.evaluate(surface.u.lower() + (i + 0.5) / looks * surface.u.length(),
                           surface.v.lower() + (j + 0.5) / looks * surface.v.length());
    }
  }
  return places;
}

double distance(const Looks& a, const Looks& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size() && most <= written_m; ++i) {
    most = std::max(most, (a[i] - b[i]).norm());
  }
  return most;
}

struct Middle {
  Vec2 uv = Vec2::Zero();
  double size_m = 0;  ///< The diagonal of what is within the trim.
};

/// The place of a grid within the trim that is the farthest from its loops and the surface's sides.
std::optional<Middle> middle_of(const SculptShape& shape) {
  const BSplineSurface& surface = *shape.surface;
  const Vec2 lower(surface.u.lower(), surface.v.lower()), size(surface.u.length(), surface.v.length());
  const auto region = geometry::TrimRegion::create(trim_loops(shape), lower, lower + size);
  EXPECT_TRUE(region.ok()) << shape.id << ": " << (region.ok() ? "" : region.error().describe());
  if (!region.ok()) return {};
  for (const int cells : {16, 64, 256}) {
    std::optional<Middle> found;
    Eigen::AlignedBox3d box;
    double deepest = 0;
    for (int i = 0; i < cells; ++i) {
      for (int j = 0; j < cells; ++j) {
        const Vec2 part((i + 0.5) / cells, (j + 0.5) / cells);
        const Vec2 uv = lower + part.cwiseProduct(size);
        if (!region->inside(uv)) continue;
        box.extend(surface.evaluate(uv.x(), uv.y()));
        double depth = std::min(part.minCoeff(), (Vec2::Ones() - part).minCoeff());
        for (const geometry::TrimLoop& loop : region->loops()) {
          for (const Vec2& p : loop) depth = std::min(depth, (p - uv).cwiseQuotient(size).norm());
        }
        if (depth > deepest && !surface.normal(uv.x(), uv.y()).isZero(0)) {
          deepest = depth;
          found = Middle{uv, 0};
        }
      }
    }
    if (!found) continue;
    for (const geometry::TrimLoop& loop : region->loops()) {
      for (const Vec2& p : loop) box.extend(surface.evaluate(p.x(), p.y()));
    }
    found->size_m = box.diagonal().norm();
    return found;
  }
  return {};
}

/// Whether a control point acts at the parameter that the held rows at both ends (clamped sides) leave free.
bool yields(const geometry::KnotVector& knots, double parameter) {
  if (knots.is_periodic()) return true;
  const int last = knots.span(parameter);
  return std::min(last, knots.control_count() - 3) >= std::max(last - knots.degree(), 2);
}

/// The line of the table.
struct Row {
  std::string out;
  std::size_t faces = 0, bsplines = 0, trimmed = 0, refined = 0, sculpted = 0;
  std::size_t valid = 0, in_file = 0, as_sculpted = 0, as_imported = 0, lost_areas = 0;
  std::size_t free_before = 0, free_after = 0, gaps = 0;  ///< Edges of one face alone; notes of gaps.
  double least_moved = 1e300, most_moved = 0;             ///< Of the face's size, where the icon is.
  double sculpting_s = 0, writing_s = 0, reading_s = 0;
};

double seconds_since(std::chrono::steady_clock::time_point begun) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

class CadSculpting : public ::testing::Test {
 protected:
  void SetUp() override {
    if (cad_files().empty()) GTEST_SKIP() << "the Debian package occt-misc is not here: no " << data_folder;
    files_.write_folder = folder_.path();
  }

  static ScriptTarget::Outcome submit(LocalTarget& target, const v1::Operation& operation) {
    const auto done = target.submit(operation);
    EXPECT_TRUE(done.ok()) << operation.ShortDebugString().substr(0, 200) << ": "
                           << (done.ok() ? "" : done.error().describe());
    return done.ok() ? *done : ScriptTarget::Outcome{};
  }

  static SculptPtr face_of(const LocalTarget& target, const std::string& id) {
    return as_sculpt(target.model().document().find(id));
  }

  /// One icon in the middle, pulled along the normal: a constraint on faces of even numbers, a load on
  /// others.
  static void sculpt(LocalTarget& target, const std::string& id, Row& row) {
    SculptPtr face = face_of(target, id);
    const auto middle = middle_of(*face);
    ASSERT_TRUE(middle) << id << " has no inside";
    bool refined = false;
    while (!yields(face->rest->u, middle->uv.x()) || !yields(face->rest->v, middle->uv.y())) {
      const auto more = [](const geometry::KnotVector& knots, double parameter) {
        const auto now = static_cast<std::uint32_t>(knots.control_count());
        return yields(knots, parameter) ? now : now + 4;
      };
      v1::Operation refine;
      refine.mutable_refine_surface()->set_entity(id);
      refine.mutable_refine_surface()->set_control_u(more(face->rest->u, middle->uv.x()));
      refine.mutable_refine_surface()->set_control_v(more(face->rest->v, middle->uv.y()));
      submit(target, refine);
      ASSERT_FALSE(HasFailure());
      refined = true;
      face = face_of(target, id);
    }
    if (refined) ++row.refined;
    const Vec2 uv = middle->uv;
    v1::Operation add;
    v1::AddIcon& icon = *add.mutable_add_icon();
    icon.set_entity(id);
    icon.set_id("pull");
    icon.set_role(face->face % 2 == 0 ? v1::ICON_CONSTRAINT : v1::ICON_LOAD);
    v1::Vec2& at = *icon.add_parameters();
    at.set_x(uv.x());
    at.set_y(uv.y());
    submit(target, add);
    const Vec3 before = face->surface->evaluate(uv.x(), uv.y());
    const Vec3 by = pull * middle->size_m * face->surface->normal(uv.x(), uv.y());
    v1::Operation drag;
    drag.mutable_drag_icon()->set_entity(id);
    drag.mutable_drag_icon()->set_icon("pull");
    v1::Vec3& along = *drag.mutable_drag_icon()->mutable_translation();
    along.set_x(by.x());
    along.set_y(by.y());
    along.set_z(by.z());
    submit(target, drag);
    const Vec3 moved = face_of(target, id)->surface->evaluate(uv.x(), uv.y()) - before;
    EXPECT_LE((moved - by).norm(), 0.01 * by.norm()) << id << " does not follow the hand";
    row.least_moved = std::min(row.least_moved, moved.norm() / middle->size_m);
    row.most_moved = std::max(row.most_moved, moved.norm() / middle->size_m);
    ++row.sculpted;
  }

  static exchange::StepContent read(const fs::path& path) {
    exchange::StepReadOptions coarse;  // What is asked is whether faces are valid.
    coarse.samples_per_side = coarse.samples_per_edge = 1;
    auto content = is_iges(path) ? exchange::read_iges(path, coarse) : exchange::read_step(path, coarse);
    EXPECT_TRUE(content.ok()) << (content.ok() ? "" : content.error().describe());
    return content.ok() ? *content : exchange::StepContent{};
  }

  /// How many areas of the first are not among those of the second, each taken once.
  static std::size_t lost(std::vector<double> expected, std::vector<double> found) {
    std::sort(expected.begin(), expected.end());
    std::sort(found.begin(), found.end());
    std::size_t count = 0;
    auto from = found.begin();
    for (const double area : expected) {
      from = std::lower_bound(from, found.end(), area * (1 - same_area));
      if (from != found.end() && *from <= area * (1 + same_area)) {
        ++from;
      } else {
        ++count;
      }
    }
    return count;
  }

  /// Exports the document, reads it again, and compares.
  void check(LocalTarget& target, const fs::path& source, const std::set<std::uint32_t>& sculpted,
             const exchange::StepContent& before, Row& row) {
    v1::Operation write;
    write.mutable_export_()->set_path("model." + row.out);
    auto begun = std::chrono::steady_clock::now();
    const ScriptTarget::Outcome outcome = submit(target, write);
    row.writing_s = seconds_since(begun);
    row.gaps = outcome.notes.size();
    if (row.gaps > 0) std::cout << "  " << outcome.notes.front() << '\n';
    begun = std::chrono::steady_clock::now();
    const fs::path path = folder_.path() / ("model." + row.out);
    const exchange::StepContent after = read(path);
    const auto again = exchange::import_cad_model(path);
    ASSERT_TRUE(again.ok()) << again.error().describe();
    row.reading_s = seconds_since(begun);
    row.in_file = after.faces.size();
    row.free_before = before.free_edges;
    row.free_after = after.free_edges;
    row.valid = static_cast<std::size_t>(
        std::count_if(after.faces.begin(), after.faces.end(), [](const auto& face) { return face.valid; }));
    std::vector<Looks> written;
    for (const auto& face : again->faces) written.push_back(look_at(face.face.surface));
    const CadModelPtr model = as_cad_model(target.model().document().find("model-1"));
    for (const std::string& id : model->faces) {
      const SculptPtr face = face_of(target, id);
      const Looks now = look_at(*face->surface);
      const bool is_changed = distance(now, look_at(*face->initial)) > written_m;
      EXPECT_EQ(is_changed, sculpted.contains(face->face)) << id;
      const bool is_there = std::any_of(written.begin(), written.end(), [&](const Looks& other) {
        return distance(now, other) <= written_m;
      });
      if (is_there) ++(is_changed ? row.as_sculpted : row.as_imported);
    }
    // Faces of all kinds that nobody sculpted, trims included.
    std::vector<double> untouched;
    for (std::size_t i = 0; i < before.faces.size(); ++i) {
      if (!sculpted.contains(static_cast<std::uint32_t>(i + 1))) untouched.push_back(before.faces[i].area_m2);
    }
    std::vector<double> areas;
    for (const auto& face : after.faces) areas.push_back(face.area_m2);
    row.lost_areas = lost(untouched, areas);
    print(source, row);
    EXPECT_EQ(row.in_file, row.faces);
    EXPECT_EQ(row.valid, row.faces);
    EXPECT_EQ(row.as_sculpted, sculpted.size());
    EXPECT_EQ(row.as_imported, row.bsplines - sculpted.size());
    EXPECT_EQ(row.lost_areas, 0U);
    // Whose free edges are as many as before did not open; what opened is told. IGES shares no edges: its
    // readers sew.
    if (row.out == "step" && !is_iges(source)) {
      EXPECT_EQ(row.free_after > row.free_before, row.gaps > 0);
    }
  }

  static void print_head() {
    std::cout << fmt::format(
        "{:<14} {:>4} {:>6} {:>8} {:>8} {:>8} {:>8} {:>15} {:>6} {:>11} {:>11} {:>5} {:>11} {:>5} {:>19}\n",
        "file", "to", "faces", "B-spline", "trimmed", "refined", "sculpted", "moved (of size)", "valid",
        "as sculpted", "as imported", "lost", "free edges", "gaps", "sculpt/write/read s");
  }
  static void print(const fs::path& source, const Row& row) {
    const std::string moved =
        row.sculpted == 0 ? "-" : fmt::format("{:.4f}..{:.4f}", row.least_moved, row.most_moved);
    const std::string seconds =
        fmt::format("{:.1f}/{:.1f}/{:.1f}", row.sculpting_s, row.writing_s, row.reading_s);
    std::cout << fmt::format(
                     "{:<14} {:>4} {:>6} {:>8} {:>8} {:>8} {:>8} {:>15} {:>6} {:>11} {:>11} {:>5} {:>11} "
                     "{:>5} {:>19}\n",
                     source.filename().string(), row.out, row.faces, row.bsplines, row.trimmed, row.refined,
                     row.sculpted, moved, row.valid, row.as_sculpted, row.as_imported, row.lost_areas,
                     fmt::format("{}->{}", row.free_before, row.free_after), row.gaps, seconds)
              << std::flush;
  }

  /// Imports, sculpts each `every`-th face, and checks what comes out in the formats.
  void run(const fs::path& source, std::size_t every, const std::vector<std::string>& formats) {
    LocalTarget target(files_);
    v1::Operation import;
    import.mutable_import_model()->set_path(source.string());
    const ScriptTarget::Outcome outcome = submit(target, import);
    EXPECT_TRUE(outcome.notes.empty()) << outcome.notes.front();
    const CadModelPtr model = as_cad_model(target.model().document().find("model-1"));
    ASSERT_TRUE(model);
    const exchange::StepContent before = read(source);
    Row row;
    row.faces = before.faces.size();
    row.bsplines = model->faces.size();
    std::set<std::uint32_t> sculpted;
    const auto begun = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < model->faces.size(); ++i) {
      const SculptPtr face = face_of(target, model->faces[i]);
      if (face->trim) ++row.trimmed;
      if (i % every != 0) continue;
      sculpt(target, face->id, row);
      if (HasFatalFailure()) return;
      sculpted.insert(face->face);
    }
    row.sculpting_s = seconds_since(begun);
    for (const std::string& format : formats) {
      row.out = format;
      row.valid = row.in_file = row.as_sculpted = row.as_imported = 0;
      check(target, source, sculpted, before, row);
    }
  }

  handloft::test::TemporaryDirectory folder_;
  FileAccess files_;
};

TEST_F(CadSculpting, EveryBSplineFaceOfOcctMiscIsSculptedByOneIconAndComesOutValid) {
  print_head();
  for (const fs::path& source : cad_files()) {
    SCOPED_TRACE(source.filename().string());
    run(source, 1, {"step", "igs"});
  }
}

TEST_F(CadSculpting, FacesBetweenSculptedOnesComeOutAsTheyWentIn) {
  print_head();
  for (const fs::path& source : cad_files()) {
    SCOPED_TRACE(source.filename().string());
    run(source, 2, {is_iges(source) ? "igs" : "step"});
  }
}

}  // namespace
}  // namespace handloft::model
