// Import of CAD models: what stands in files made by Open CASCADE itself comes as our surfaces, exactly, with
// trims; damaged files and bytes become errors.

#include <gtest/gtest.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepGProp.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRep_Tool.hxx>
#include <Eigen/Geometry>
#include <GProp_GProps.hxx>
#include <Precision.hxx>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <random>

#include "common/record/crc32c.h"
#include "server-model/exchange/cad_bytes.h"
#include "server-model/exchange/cad_import.h"
#include "server-model/exchange/occt_bspline.h"
#include "server-model/exchange/step_writer.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/exchange/cad_models.h"

namespace handloft::exchange {
namespace {

using geometry::Vec2;
using geometry::Vec3;

constexpr double exact_m = 1e-12;  // What rounding leaves of lengths below a metre, written with 15 digits.

Vec2 at_middle(const TrimCurve& curve) {
  // Lines have two control points; for others the middle one is near enough to tell inside from outside.
  return 0.5 * (curve.control.front() + curve.control.back());
}

/// Twice the area within the polygon of a loop's control points, positive counterclockwise.
double turning(const std::vector<TrimCurve>& loop) {
  double sum = 0;
  Vec2 before = loop.back().control.back();
  for (const TrimCurve& curve : loop) {
    for (const Vec2& p : curve.control) {
      sum += before.x() * p.y() - before.y() * p.x();
      before = p;
    }
  }
  return sum;
}

class CadImport : public ::testing::Test {
 protected:
  ImportedModel import(const std::filesystem::path& path, const CadImportOptions& options = {}) {
    auto model = import_cad_model(path, options);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().describe());
    return model.ok() ? std::move(*model) : ImportedModel{};
  }
  ImportedModel import_step(const TopoDS_Shape& shape, const std::string& unit = "MM") {
    test::write_step_file(step_, {shape}, unit);
    return import(step_);
  }
  handloft::test::TemporaryDirectory folder_;
  std::filesystem::path step_ = folder_.path() / "model.step";
  std::filesystem::path iges_ = folder_.path() / "model.igs";
};

TEST_F(CadImport, ABoxWithOneFreeformFaceGivesThatFaceAndTrianglesOfTheOthers) {
  const ImportedModel model = import_step(test::box_with_freeform_top(100, 20));
  EXPECT_EQ(model.face_count, 6U);
  ASSERT_EQ(model.faces.size(), 1U);
  const CadFace& face = model.faces[0].face;
  EXPECT_EQ(face.surface.u.degree(), 3);
  EXPECT_EQ(face.surface.u.control_count(), 8);
  EXPECT_FALSE(face.surface.is_rational());
  EXPECT_TRUE(face.loops.empty()) << "the trim is the whole rectangle";
  const Handle(Geom_BSplineSurface) made = test::sheet(8, 100, 20);
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) {
      const gp_Pnt p = made->Pole(i + 1, j + 1);
      EXPECT_NEAR((face.surface.at(i, j) - 1e-3 * Vec3(p.X(), p.Y(), p.Z() + 100)).norm(), 0, exact_m);
    }
  }
  // The rest: five sides of the box.
  ASSERT_FALSE(model.rest_indices.empty());
  double area = 0;
  for (std::size_t t = 0; t + 2 < model.rest_indices.size(); t += 3) {
    const Vec3& a = model.rest_positions[model.rest_indices[t]];
    const Vec3& b = model.rest_positions[model.rest_indices[t + 1]];
    const Vec3& c = model.rest_positions[model.rest_indices[t + 2]];
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  EXPECT_NEAR(area, 5 * 0.01, 1e-7);
  EXPECT_TRUE(model.notes.empty());
}

TEST_F(CadImport, TheTranslationMovesSurfacesAndTriangles) {
  test::write_step_file(step_, {test::box_with_freeform_top(100, 20)});
  CadImportOptions options;
  options.translation = {1, 2, 3};
  const ImportedModel there = import(step_, options);
  const ImportedModel here = import(step_);
  ASSERT_EQ(there.faces.size(), 1U);
  ASSERT_EQ(here.faces.size(), 1U);
  EXPECT_NEAR(
      (there.faces[0].face.surface.at(3, 4) - here.faces[0].face.surface.at(3, 4) - options.translation)
          .norm(),
      0, 1e-12);
  EXPECT_NEAR((there.rest_positions[0] - here.rest_positions[0] - options.translation).norm(), 0, 1e-6);
  EXPECT_EQ(there.boundary_representation, here.boundary_representation);
}

TEST_F(CadImport, APeriodicSurfaceStaysPeriodicWithItsParameters) {
  const TopoDS_Face tube = test::periodic_tube(30, 80);
  const ImportedModel model = import_step(tube);
  ASSERT_EQ(model.faces.size(), 1U);
  const geometry::BSplineSurface& surface = model.faces[0].face.surface;
  EXPECT_FALSE(surface.v.is_periodic());
  const double seam =
      (surface.evaluate(surface.u.lower(), 1) - surface.evaluate(surface.u.upper(), 1)).norm();
  EXPECT_NEAR(seam, 0, 1e-12);
}

// The importer's own conversion, without what a file format does to a surface in between.
TEST(CadBSpline, PeriodicSurfacesOfEveryMultiplicityAgreeWithTheLibraryEverywhere) {
  const auto expect_same = [](const Handle(Geom_BSplineSurface) & spline) {
    auto ours = detail::to_geometry(spline, {1.0, Vec3::Zero()});
    ASSERT_TRUE(ours.ok()) << ours.error().describe();
    ASSERT_TRUE(ours->u.is_periodic());
    auto back = detail::to_occt(*ours, {1.0, Vec3::Zero()});
    ASSERT_TRUE(back.ok()) << back.error().describe();
    double u0 = 0;
    double u1 = 0;
    double v0 = 0;
    double v1 = 0;
    spline->Bounds(u0, u1, v0, v1);
    EXPECT_EQ(ours->u.lower(), u0);
    EXPECT_EQ(ours->u.upper(), u1);
    for (int i = 0; i <= 50; ++i) {
      for (int j = 0; j <= 5; ++j) {
        const double u = u0 + (u1 - u0) * i / 50;
        const double v = v0 + (v1 - v0) * j / 5;
        const gp_Pnt p = spline->Value(u, v);
        const gp_Pnt q = (*back)->Value(u, v);
        EXPECT_NEAR((ours->evaluate(u, v) - Vec3(p.X(), p.Y(), p.Z())).norm(), 0, 1e-11) << u << " " << v;
        EXPECT_NEAR(p.Distance(q), 0, 1e-11) << u << " " << v;
      }
    }
  };
  const auto tube = [] {
    return Handle(Geom_BSplineSurface)::DownCast(BRep_Tool::Surface(test::periodic_tube(30, 80))->Copy());
  };
  expect_same(tube());
  for (const int seam_multiplicity : {2, 3}) {
    Handle(Geom_BSplineSurface) spline = tube();
    spline->InsertUKnot(spline->UKnot(1), seam_multiplicity, 1e-9, Standard_False);
    ASSERT_EQ(spline->UMultiplicity(1), seam_multiplicity);
    expect_same(spline);
  }
  Handle(Geom_BSplineSurface) inner = tube();
  inner->InsertUKnot(4.5, 2, 1e-9);
  expect_same(inner);
  Handle(Geom_BSplineSurface) sphere =
      Handle(Geom_BSplineSurface)::DownCast(BRep_Tool::Surface(test::rational_sphere(25))->Copy());
  ASSERT_TRUE(sphere->IsUPeriodic());
  expect_same(sphere);
}

TEST_F(CadImport, ARationalSphereLiesOnTheSphere) {
  const ImportedModel model = import_step(test::rational_sphere(25));
  ASSERT_EQ(model.faces.size(), 1U);
  const geometry::BSplineSurface& surface = model.faces[0].face.surface;
  EXPECT_TRUE(surface.is_rational());
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 20; ++j) {
      const Vec3 p = surface.evaluate(surface.u.lower() + surface.u.length() * i / 20,
                                      surface.v.lower() + surface.v.length() * j / 20);
      EXPECT_NEAR(p.norm(), 0.025, exact_m);
    }
  }
}

TEST_F(CadImport, HolesComeAsLoopsWithTheFaceOnTheirLeft) {
  for (const bool reversed : {false, true}) {
    TopoDS_Shape sheet = test::sheet_with_two_holes(50, 5);
    if (reversed) sheet.Reverse();
    const ImportedModel model = import_step(sheet);
    ASSERT_EQ(model.faces.size(), 1U);
    const CadFace& face = model.faces[0].face;
    EXPECT_EQ(face.reversed, reversed);
    ASSERT_EQ(face.loops.size(), 3U);
    EXPECT_GT(turning(face.loops[0]), 1.9) << "the outer loop first, counterclockwise";
    std::vector<std::size_t> sizes;
    for (std::size_t l = 0; l < 3; ++l) {
      if (l > 0) {
        EXPECT_LT(turning(face.loops[l]), 0) << "holes clockwise";
      }
      sizes.push_back(face.loops[l].size());
      for (std::size_t c = 0; c < face.loops[l].size(); ++c) {
        const TrimCurve& next = face.loops[l][(c + 1) % face.loops[l].size()];
        EXPECT_NEAR((face.loops[l][c].control.back() - next.control.front()).norm(), 0, 1e-7);
      }
    }
    std::sort(sizes.begin() + 1, sizes.end());
    EXPECT_EQ(sizes.back(), 4U) << "the square";
    for (const auto& loop : face.loops) {
      if (loop.size() != 4) continue;
      for (const TrimCurve& line : loop) {
        EXPECT_EQ(line.knots.degree(), 1) << "lines stay lines";
        EXPECT_TRUE(at_middle(line).allFinite());
      }
    }
  }
}

TEST_F(CadImport, InchesBecomeMetres) {
  const ImportedModel inches = import_step(test::box_with_freeform_top(100, 20), "INCH");
  const ImportedModel millimetres = import_step(test::box_with_freeform_top(100, 20));
  std::ifstream stream(step_);
  ASSERT_EQ(inches.faces.size(), 1U);
  ASSERT_EQ(millimetres.faces.size(), 1U);
  for (std::size_t i = 0; i < inches.faces[0].face.surface.control.size(); ++i) {
    EXPECT_NEAR(
        (inches.faces[0].face.surface.control[i] - millimetres.faces[0].face.surface.control[i]).norm(), 0,
        exact_m);
  }
  EXPECT_EQ(inches.metres_per_unit, 0.001);
}

TEST_F(CadImport, ReadsIges) {
  test::write_iges_file(iges_, {test::sheet_with_two_holes(50, 5), test::periodic_tube(30, 80)});
  const ImportedModel model = import(iges_);
  ASSERT_EQ(model.faces.size(), 2U);
  EXPECT_EQ(model.faces[0].number, 1U);
  EXPECT_EQ(model.faces[1].number, 2U);
  EXPECT_EQ(model.faces[0].face.loops.size(), 3U);
  const Handle(Geom_BSplineSurface) made = test::sheet(10, 50, 5);
  const gp_Pnt p = made->Value(0.3, 0.7);
  EXPECT_NEAR((model.faces[0].face.surface.evaluate(0.3, 0.7) - 1e-3 * Vec3(p.X(), p.Y(), p.Z())).norm(), 0,
              1e-9);
}

TEST_F(CadImport, AModelWithoutBSplinesIsAllTriangles) {
  const ImportedModel model = import_step(BRepPrimAPI_MakeBox(10, 20, 30).Shape());
  EXPECT_TRUE(model.faces.empty());
  EXPECT_EQ(model.face_count, 6U);
  EXPECT_EQ(model.rest_indices.size(), 36U);
}

TEST_F(CadImport, StopsMakingTrianglesWhenTold) {
  test::write_step_file(step_, {BRepPrimAPI_MakeBox(10, 20, 30).Shape()});
  CadImportOptions options;
  options.keep_going = [] { return false; };
  const ImportedModel model = import(step_, options);
  EXPECT_LT(model.rest_indices.size(), 36U);
  ASSERT_EQ(model.notes.size(), 1U);
  EXPECT_NE(model.notes[0].find("took too long"), std::string::npos) << model.notes[0];
}

TEST_F(CadImport, BoundsAreKept) {
  test::write_step_file(step_, {test::box_with_freeform_top(100, 20), test::sheet_with_two_holes(50, 5)});
  const auto error_with = [&](auto change) {
    CadImportOptions options;
    change(options);
    auto model = import_cad_model(step_, options);
    EXPECT_FALSE(model.ok());
    return model.ok() ? Error{} : model.error();
  };
  for (const Error& error : {
           error_with([](CadImportOptions& o) { o.max_file_bytes = 1000; }),
           error_with([](CadImportOptions& o) { o.max_model_bytes = 1000; }),
           error_with([](CadImportOptions& o) { o.max_faces = 1; }),
           error_with([](CadImportOptions& o) { o.max_all_faces = 3; }),
           error_with([](CadImportOptions& o) { o.max_control_points = 99; }),
           error_with([](CadImportOptions& o) { o.max_trim_curves = 6; }),
           error_with([](CadImportOptions& o) { o.max_triangles = 9; }),
           error_with([](CadImportOptions& o) { o.max_coordinate_m = 0.05; }),
       }) {
    EXPECT_EQ(error.code, ErrorCode::resource_exhausted) << error.describe();
    EXPECT_EQ(error.field, "path");
    EXPECT_EQ(error.message.rfind("model.step: ", 0), 0U) << error.message;
  }
  CadImportOptions nowhere;
  nowhere.translation.x() = std::nan("");
  EXPECT_EQ(import_cad_model(step_, nowhere).error().field, "translation");
}

TEST_F(CadImport, WhatIsNoCadFileIsAnError) {
  EXPECT_EQ(import_cad_model(folder_.path() / "missing.step").error().code, ErrorCode::not_found);
  EXPECT_EQ(import_cad_model(folder_.path() / "model.obj").error().code, ErrorCode::unsupported);
  std::filesystem::create_directory(folder_.path() / "folder.step");
  EXPECT_EQ(import_cad_model(folder_.path() / "folder.step").error().code, ErrorCode::io);
  for (const char* name : {"empty.step", "empty.iges"}) {
    std::ofstream(folder_.path() / name).flush();
    EXPECT_EQ(import_cad_model(folder_.path() / name).error().code, ErrorCode::data_corrupt) << name;
  }
  std::ofstream(folder_.path() / "words.step") << "this is no model\n";
  EXPECT_EQ(import_cad_model(folder_.path() / "words.step").error().code, ErrorCode::data_corrupt);
}

std::string content_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// An error that begins with the file's name and says what was expected.
void expect_named(const Result<ImportedModel>& model, const std::string& name) {
  ASSERT_FALSE(model.ok()) << name;
  EXPECT_EQ(model.error().code, ErrorCode::data_corrupt) << model.error().describe();
  EXPECT_EQ(model.error().field, "path");
  EXPECT_EQ(model.error().message.rfind(name + ": ", 0), 0U) << model.error().message;
  EXPECT_NE(model.error().message.find("expected"), std::string::npos) << model.error().message;
}

// What is there of a model must not be taken for the whole of it.
TEST_F(CadImport, CutOffFilesAreErrorsThatSaySo) {
  test::write_step_file(folder_.path() / "whole.step", {test::box_with_freeform_top(100, 20)});
  test::write_iges_file(folder_.path() / "whole.igs", {test::box_with_freeform_top(100, 20)});
  std::vector<std::filesystem::path> files{folder_.path() / "whole.step", folder_.path() / "whole.igs"};
  for (const char* real : {"step/screw.step", "iges/bearing.iges"}) {  // Of the package occt-misc.
    const auto path = std::filesystem::path("/usr/share/opencascade/data") / real;
    if (std::filesystem::exists(path)) files.push_back(path);
  }
  for (const std::filesystem::path& file : files) {
    const std::string whole = content_of(file);
    const std::filesystem::path damaged = folder_.path() / ("damaged" + file.extension().string());
    for (std::size_t part = 0; part < 8; ++part) {
      std::ofstream(damaged, std::ios::binary) << whole.substr(0, whole.size() * part / 8);
      expect_named(import_cad_model(damaged), damaged.filename().string());
    }
  }
}

TEST_F(CadImport, FilesOfAnotherKindAreErrorsThatNameWhatWasExpected) {
  test::write_step_file(folder_.path() / "model.step", {test::box_with_freeform_top(100, 20)});
  test::write_iges_file(folder_.path() / "model.igs", {test::box_with_freeform_top(100, 20)});
  std::filesystem::rename(folder_.path() / "model.step", folder_.path() / "step.igs");
  std::filesystem::rename(folder_.path() / "model.igs", folder_.path() / "iges.step");
  expect_named(import_cad_model(folder_.path() / "step.igs"), "step.igs");
  expect_named(import_cad_model(folder_.path() / "iges.step"), "iges.step");
  std::mt19937 random(3);
  std::string noise(20'000, ' ');
  for (char& c : noise) c = static_cast<char>(random());
  for (const char* name : {"noise.stp", "noise.iges"}) {
    std::ofstream(folder_.path() / name, std::ios::binary) << noise;
    expect_named(import_cad_model(folder_.path() / name), name);
  }
  std::ofstream(folder_.path() / "ends.step") << "nothing but an end\nEND-ISO-10303-21;\n";
  expect_named(import_cad_model(folder_.path() / "ends.step"), "ends.step");
}

// Digits and letters changed here and there: an error that names the file, or a model that is sound.
TEST_F(CadImport, CorruptFilesNeverCrash) {
  test::write_step_file(folder_.path() / "whole.step", {test::box_with_freeform_top(100, 20)});
  test::write_iges_file(folder_.path() / "whole.igs", {test::box_with_freeform_top(100, 20)});
  std::mt19937 random(11);
  for (const char* extension : {".step", ".igs"}) {
    const std::string whole = content_of(folder_.path() / ("whole" + std::string(extension)));
    const std::filesystem::path damaged = folder_.path() / ("damaged" + std::string(extension));
    for (int round = 0; round < 12; ++round) {
      std::string bytes = whole;
      for (int i = 0; i < 1 + 4 * round; ++i)
        bytes[random() % bytes.size()] = "0159#(),'.E-*$"[random() % 14];
      std::ofstream(damaged, std::ios::binary) << bytes;
      const auto model = import_cad_model(damaged);
      if (!model.ok()) {
        EXPECT_EQ(model.error().field, "path");
        EXPECT_EQ(model.error().message.rfind(damaged.filename().string() + ": ", 0), 0U);
        continue;
      }
      for (const ImportedFace& face : model->faces) EXPECT_TRUE(geometry::check(face.face.surface).ok());
    }
  }
}

TEST_F(CadImport, DamagedBytesOfAModelAreNeverGivenToTheLibrary) {
  const std::string good = import_step(test::box_with_freeform_top(100, 20)).boundary_representation;
  ASSERT_TRUE(detail::from_bytes(good).ok());
  const auto refused = [](const std::string& bytes) {
    const auto shape = detail::from_bytes(bytes);
    return !shape.ok() && shape.error().code == ErrorCode::data_corrupt &&
           shape.error().field == "boundary_representation";
  };
  EXPECT_TRUE(refused(""));
  EXPECT_TRUE(refused("HLBREP1\n"));
  EXPECT_TRUE(refused(good.substr(20)));
  EXPECT_TRUE(refused(good + "x"));
  std::mt19937 random(7);
  for (int i = 0; i < 300; ++i) {
    std::string bytes = good;
    bytes[random() % bytes.size()] ^= static_cast<char>(1U << (random() % 8));
    EXPECT_TRUE(refused(bytes)) << i;
    EXPECT_TRUE(refused(good.substr(0, random() % good.size()))) << i;
    std::string noise(random() % 500, ' ');
    for (char& c : noise) c = static_cast<char>(random());
    EXPECT_TRUE(refused(noise)) << i;
    EXPECT_TRUE(refused("HLBREP1\n" + noise)) << i;
  }
}

}  // namespace
}  // namespace handloft::exchange
