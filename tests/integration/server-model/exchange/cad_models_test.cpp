// Every B-spline face of the models that Open CASCADE ships (Debian package occt-misc) imports, is changed,
// is exported and is valid on re-import, in STEP and IGES: the promise for what comes in and goes
// out. The sculpting itself is tested where it is; here a smooth bump stands for it.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/cad_import.h"
#include "server-model/exchange/iges_writer.h"
#include "server-model/exchange/step_reader.h"
#include "server-model/exchange/step_writer.h"
#include "tests/support/test_data.h"

namespace handloft::exchange {
namespace {

namespace fs = std::filesystem;
using geometry::BSplineSurface;
using geometry::Vec3;

constexpr const char* data_folder = "/usr/share/opencascade/data";  // Of the package occt-misc.

std::vector<fs::path> models() {
  std::vector<fs::path> found;
  std::error_code failed;
  for (const auto& entry : fs::recursive_directory_iterator(data_folder, failed)) {
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension == ".step" || extension == ".stp" || extension == ".iges" || extension == ".igs") {
      found.push_back(entry.path());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

double diagonal(const BSplineSurface& surface) {
  Vec3 lower = surface.control.front();
  Vec3 upper = lower;
  for (const Vec3& p : surface.control) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  return (upper - lower).norm();
}

/// A hundredth of the surface's size along its normal in the middle, falling off to nothing at its border;
/// where control points are one place (poles, seams) the bump is nothing or the same.
BSplineSurface with_bump(BSplineSurface surface) {
  const double height = 0.01 * diagonal(surface);
  const Vec3 normal = surface.normal(surface.u.lower() + 0.5 * surface.u.length(),
                                     surface.v.lower() + 0.5 * surface.v.length());
  const auto fall = [](const geometry::KnotVector& knots, int i) {
    if (knots.control_count() < 3) return knots.is_periodic() ? 1.0 : 0.0;
    const double x = (knots.greville(i) - knots.lower()) / knots.length();
    const double s = std::sin(std::numbers::pi * x);
    return s * s;
  };
  for (int i = 0; i < surface.u.control_count(); ++i) {
    for (int j = 0; j < surface.v.control_count(); ++j) {
      surface.control[surface.index(i, j)] += height * fall(surface.u, i) * fall(surface.v, j) * normal;
    }
  }
  return surface;
}

/// What became of one file in one format.
struct Row {
  std::size_t faces = 0, bsplines = 0, trimmed = 0;
  std::size_t valid_before = 0, valid_after = 0, in_file_after = 0;
  std::size_t shapes_kept = 0;  ///< Changed surfaces that came back as they were written.
  std::size_t single_valid = 0;
  double seconds = 0;
};

/// Cheap: what is asked is whether faces are valid.
StepReadOptions coarse() {
  StepReadOptions options;
  options.samples_per_side = 1;
  options.samples_per_edge = 1;
  return options;
}

Result<StepContent> read(const fs::path& path) {
  return path.extension() == ".igs" || path.extension() == ".iges" ? read_iges(path, coarse())
                                                                   : read_step(path, coarse());
}

Status write(const fs::path& path, const CadContent& content) {
  return path.extension() == ".igs" ? write_iges(path, content) : write_step(path, content);
}

std::size_t valid_faces(const StepContent& content) {
  return static_cast<std::size_t>(std::count_if(content.faces.begin(), content.faces.end(),
                                                [](const StepFace& face) { return face.valid; }));
}

/// Whether two surfaces have the same places over a grid in their parameters.
bool same_shape(const BSplineSurface& a, const BSplineSurface& b) {
  constexpr int looks = 7;
  constexpr double written_m = 1e-9;  // Fifteen digits of a metre, and IGES's own rounding.
  for (int i = 0; i < looks; ++i) {
    for (int j = 0; j < looks; ++j) {
      const double s = (i + 0.5) / looks;
      const double t = (j + 0.5) / looks;
      const Vec3 p = a.evaluate(a.u.lower() + s * a.u.length(), a.v.lower() + t * a.v.length());
      const Vec3 q = b.evaluate(b.u.lower() + s * b.u.length(), b.v.lower() + t * b.v.length());
      if ((p - q).norm() > written_m) return false;
    }
  }
  return true;
}

/// How many of the faces are among those of a model, which may have them in another order.
std::size_t found_again(const std::vector<CadFace>& faces, const ImportedModel& model) {
  return static_cast<std::size_t>(std::count_if(faces.begin(), faces.end(), [&](const CadFace& face) {
    return std::any_of(model.faces.begin(), model.faces.end(), [&](const ImportedFace& other) {
      return same_shape(face.surface, other.face.surface);
    });
  }));
}

class CadModels : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (models().empty()) GTEST_SKIP() << "the Debian package occt-misc is not here: no " << data_folder;
  }

  /// Imports, changes every B-spline face, exports into this test's format, and reads that again.
  Row round_trip(const fs::path& path) {
    const auto begun = std::chrono::steady_clock::now();
    Row row;
    const auto model = import_cad_model(path);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().describe());
    const auto before = read(path);
    EXPECT_TRUE(before.ok()) << (before.ok() ? "" : before.error().describe());
    if (!model.ok() || !before.ok()) return row;
    EXPECT_TRUE(model->notes.empty()) << model->notes.front();
    row.faces = model->face_count;
    row.bsplines = model->faces.size();
    row.valid_before = valid_faces(*before);

    std::vector<ModelExport> changed(1);
    changed[0].name = path.stem().string();
    changed[0].boundary_representation = std::make_shared<const std::string>(model->boundary_representation);
    std::vector<CadFace> single;
    for (const ImportedFace& face : model->faces) {
      changed[0].replaced.push_back({face.number, with_bump(face.face.surface)});
      single.push_back(face.face);
      single.back().surface = changed[0].replaced.back().surface;
      if (!face.face.loops.empty()) ++row.trimmed;
    }
    const fs::path out = folder_.path() / ("model." + std::string(GetParam()));
    const Status written = write(out, {{}, {}, changed});
    EXPECT_TRUE(written.ok()) << written.error().describe();
    const auto after = read(out);
    const auto again = import_cad_model(out);
    EXPECT_TRUE(after.ok() && again.ok()) << (after.ok() ? again.error() : after.error()).describe();
    if (!after.ok() || !again.ok()) return row;
    EXPECT_TRUE(after->valid || !before->valid);
    row.in_file_after = after->faces.size();
    row.valid_after = valid_faces(*after);
    row.shapes_kept = found_again(single, *again);
    if (!single.empty()) {
      const fs::path alone = folder_.path() / ("faces." + std::string(GetParam()));
      const Status faces_written = write(alone, {{}, single, {}});
      EXPECT_TRUE(faces_written.ok()) << faces_written.error().describe();
      const auto faces = read(alone);
      EXPECT_TRUE(faces.ok()) << (faces.ok() ? "" : faces.error().describe());
      if (faces.ok()) row.single_valid = valid_faces(*faces);
    }
    row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    return row;
  }

  handloft::test::TemporaryDirectory folder_;
};

TEST_P(CadModels, EveryBSplineFaceOfOcctMiscComesInIsChangedAndGoesOutValid) {
  std::cout << fmt::format("{:<14} {:>4} {:>6} {:>8} {:>8} {:>12} {:>12} {:>10} {:>12} {:>7}\n", "file", "to",
                           "faces", "B-spline", "trimmed", "valid before", "valid after", "same shape",
                           "valid single", "seconds");
  for (const fs::path& path : models()) {
    SCOPED_TRACE(path.filename().string());
    const Row row = round_trip(path);
    std::cout << fmt::format("{:<14} {:>4} {:>6} {:>8} {:>8} {:>12} {:>12} {:>10} {:>12} {:>7.1f}\n",
                             path.filename().string(), GetParam(), row.faces, row.bsplines, row.trimmed,
                             row.valid_before, row.valid_after, row.shapes_kept, row.single_valid,
                             row.seconds);
    EXPECT_GT(row.faces, 0U);
    EXPECT_EQ(row.in_file_after, row.faces);
    EXPECT_EQ(row.valid_after, row.faces);
    EXPECT_EQ(row.shapes_kept, row.bsplines);
    EXPECT_EQ(row.single_valid, row.bsplines);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, CadModels, ::testing::Values("step", "igs"),
                         [](const auto& instance) { return std::string(instance.param); });

}  // namespace
}  // namespace handloft::exchange
