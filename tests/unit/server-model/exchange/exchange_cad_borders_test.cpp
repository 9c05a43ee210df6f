// Edges between faces of an exported model (issue: in and out): neighbours that moved alike share theirs, to
// the bit where they held it; others come apart, stay valid, and are named with the gap. And what a file says
// of the parts: names and colours go out as they came in.

#include <gtest/gtest.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Precision.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <gp_Ax1.hxx>
#include <iterator>
#include <map>
#include <memory>
#include <regex>
#include <set>

#include "server-model/exchange/cad_bytes.h"
#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/cad_import.h"
#include "server-model/exchange/iges_writer.h"
#include "server-model/exchange/occt_bspline.h"
#include "server-model/exchange/step_reader.h"
#include "server-model/exchange/step_writer.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/exchange/cad_models.h"

namespace handloft::exchange {
namespace {

namespace fs = std::filesystem;
using geometry::BSplineSurface;
using geometry::Vec3;

/// Sheets of 40 mm in a row along x, sewn.
TopoDS_Shape row_of_sheets(int count) {
  BRepBuilderAPI_Sewing sewing(1e-6);
  for (int i = 0; i < count; ++i) {
    const Handle(Geom_BSplineSurface) surface = test::sheet(8, 40, 6);
    surface->Translate(gp_Vec(40.0 * i, 0, 0));
    sewing.Add(BRepBuilderAPI_MakeFace(surface, Precision::Confusion()).Face());
  }
  sewing.Perform();
  return sewing.SewedShape();
}

using Push = std::function<double(double x, double y)>;

/// Control points up by what `push` says of their place.
BSplineSurface pushed(BSplineSurface surface, const Push& push) {
  for (Vec3& p : surface.control) p.z() += push(p.x(), p.y());
  return surface;
}

std::string text_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

class CadBorders : public ::testing::Test {
 protected:
  ImportedModel import(const fs::path& path) {
    auto model = import_cad_model(path);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().describe());
    return model.ok() ? std::move(*model) : ImportedModel{};
  }

  void use(const TopoDS_Shape& shape) {
    test::write_step_file(in_, {shape});
    use_file();
  }
  void use_file() {
    imported_ = import(in_);
    models_.assign(1, {});
    models_[0].name = "model";
    models_[0].boundary_representation =
        std::make_shared<const std::string>(imported_.boundary_representation);
    before_ = *read_step(in_);
  }

  void replace(std::size_t i, const Push& push) {
    const ImportedFace& face = imported_.faces.at(i);
    models_[0].replaced.push_back({face.number, pushed(face.face.surface, push)});
  }

  /// Writes in the format of the extension, and reads what the file holds.
  StepContent written(const char* extension) {
    gaps_.clear();
    StepOptions options;
    options.on_gap = [&](const BorderGap& gap) { gaps_.push_back(gap); };
    out_ = folder_.path() / ("out." + std::string(extension));
    const bool is_step = std::string(extension) == "step";
    const Status status =
        is_step ? write_step(out_, {{}, {}, models_}, options) : write_iges(out_, {{}, {}, models_}, options);
    EXPECT_TRUE(status.ok()) << (status.ok() ? "" : status.error().describe());
    auto read = is_step ? read_step(out_) : read_iges(out_);
    EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().describe());
    return read.ok() ? *read : StepContent{};
  }

  handloft::test::TemporaryDirectory folder_;
  fs::path in_ = folder_.path() / "in.step", out_;
  ImportedModel imported_;
  StepContent before_;
  std::vector<ModelExport> models_;
  std::vector<BorderGap> gaps_;
};

TEST_F(CadBorders, FreeEdgesCountWhatOneFaceAloneHas) {
  use(test::box_with_freeform_top(100, 20));
  EXPECT_EQ(before_.free_edges, 0U);
  use(row_of_sheets(1));
  EXPECT_EQ(before_.free_edges, 4U);
  use(row_of_sheets(3));
  EXPECT_EQ(before_.free_edges, 8U);
  use(test::periodic_tube(30, 80));
  EXPECT_EQ(before_.free_edges, 2U) << "its seam is none";
  use(test::rational_sphere(25));
  EXPECT_EQ(before_.free_edges, 0U) << "nor are its poles";
}

TEST_F(CadBorders, NeighboursThatHoldTheirBorderShareItStill) {
  use(row_of_sheets(3));
  ASSERT_EQ(imported_.faces.size(), 3U);
  for (const std::size_t i : {0U, 1U}) {
    replace(i, [i](double x, double y) {  // Two rings of control points stay.
      const double s = (x - 0.04 * static_cast<double>(i)) / 0.04;
      const bool inside = std::min({s, 1 - s, y / 0.04, 1 - y / 0.04}) > 0.2;
      return inside ? 0.004 : 0.0;
    });
  }
  const StepContent after = written("step");
  EXPECT_TRUE(after.valid);
  EXPECT_EQ(after.faces.size(), 3U);
  EXPECT_EQ(after.free_edges, before_.free_edges);
  EXPECT_TRUE(gaps_.empty());
  EXPECT_TRUE(written("igs").valid);
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(CadBorders, NeighboursThatMovedTheirEdgeAlikeShareItAgain) {
  use(row_of_sheets(2));
  ASSERT_EQ(imported_.faces.size(), 2U);
  // By the same function of places: the common edge's control points are the same on both sides.
  const Push wave = [](double x, double y) { return 0.01 * std::sin(60 * x) + 0.2 * y * y; };
  replace(0, wave);
  replace(1, wave);
  const StepContent after = written("step");
  EXPECT_TRUE(after.valid);
  EXPECT_EQ(after.faces.size(), 2U);
  EXPECT_EQ(after.free_edges, 6U);
  EXPECT_TRUE(gaps_.empty());
  const ImportedModel again = import(out_);
  ASSERT_EQ(again.faces.size(), 2U);
  for (std::size_t f = 0; f < 2; ++f) {
    const auto& expected = models_[0].replaced[f].surface.control;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_NEAR((again.faces[f].face.surface.control[i] - expected[i]).norm(), 0, 1e-12);
    }
  }
}

TEST_F(CadBorders, NeighboursThatMovedAlikeWithinTheToleranceShareTheirEdge) {
  use(row_of_sheets(2));
  replace(0, [](double, double) { return 0.01; });
  replace(1, [](double, double) { return 0.01 + 0.8e-7; });
  EXPECT_EQ(written("step").free_edges, 6U);
  EXPECT_TRUE(gaps_.empty());
  models_[0].border_tolerance_m = 0.5e-7;  // Not within this one.
  const StepContent apart = written("step");
  EXPECT_EQ(apart.free_edges, 8U);
  ASSERT_EQ(gaps_.size(), 1U);
  EXPECT_NEAR(gaps_[0].gap_m, 0.8e-7, 1e-12);
}

TEST_F(CadBorders, ThoseThatCameApartAreShellsOfTheirOwnAndNamedWithTheGap) {
  use(row_of_sheets(3));
  ASSERT_EQ(imported_.faces.size(), 3U);
  replace(1, [](double, double) { return 0.003; });
  replace(2, [](double, double) { return 0.003; });
  for (const char* format : {"step", "igs"}) {
    const StepContent after = written(format);
    EXPECT_TRUE(after.valid);
    EXPECT_EQ(after.faces.size(), 3U);
    ASSERT_EQ(gaps_.size(), 1U);
    EXPECT_EQ(gaps_[0].model, 0U);
    EXPECT_EQ(gaps_[0].face, imported_.faces[0].number);
    EXPECT_EQ(gaps_[0].neighbour, imported_.faces[1].number);
    EXPECT_NEAR(gaps_[0].gap_m, 0.003, 1e-12);
  }
  const StepContent after = written("step");
  EXPECT_EQ(after.free_edges, 4U + 6U);
}

// A face that lets go of one side only: it keeps its other edges, so that nothing else opens.
TEST_F(CadBorders, AFaceKeepsTheEdgesThatItHolds) {
  use(test::box_with_freeform_top(100, 20));
  ASSERT_EQ(imported_.faces.size(), 1U);
  replace(0, [](double x, double) { return x > 0.05 ? 0.2 * (x - 0.05) * (x - 0.05) : 0.0; });
  const StepContent after = written("step");
  EXPECT_TRUE(after.valid);
  ASSERT_EQ(after.faces.size(), 6U);
  EXPECT_EQ(after.solids, 0U);
  // The side that moved, and the two that lead to it: each is one edge here and one there.
  EXPECT_EQ(after.free_edges, 6U);
  ASSERT_EQ(gaps_.size(), 3U);
  double widest = 0;
  for (const BorderGap& gap : gaps_) {
    EXPECT_TRUE(gap.face == imported_.faces[0].number || gap.neighbour == imported_.faces[0].number);
    widest = std::max(widest, gap.gap_m);
  }
  EXPECT_NEAR(widest, 0.2 * 0.05 * 0.05, 1e-12);
}

// The same part twice in an assembly: the changed one must stand where the assembly has it.
TEST_F(CadBorders, AChangedFaceOfAnAssemblyStandsInItsPlace) {
  const TopoDS_Shape box = test::box_with_freeform_top(100, 20);
  const BRep_Builder builder;
  TopoDS_Compound two;
  builder.MakeCompound(two);
  builder.Add(two, box);
  gp_Trsf aside;
  aside.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 0.5);
  aside.SetTranslationPart(gp_Vec(300, 0, 0));
  builder.Add(two, box.Moved(TopLoc_Location(aside)));
  use(two);
  ASSERT_EQ(imported_.faces.size(), 2U);
  const BSplineSurface& second = imported_.faces[1].face.surface;
  BSplineSurface changed = second;
  for (int i = 2; i < 6; ++i) {
    for (int j = 2; j < 6; ++j) changed.control[changed.index(i, j)].z() += 0.004;
  }
  models_[0].replaced = {{imported_.faces[0].number, imported_.faces[0].face.surface},
                         {imported_.faces[1].number, changed}};
  const StepContent after = written("step");
  EXPECT_TRUE(after.valid);
  EXPECT_EQ(after.solids, 2U);
  EXPECT_EQ(after.closed_shells, 2U);
  EXPECT_EQ(after.free_edges, 0U);
  const ImportedModel again = import(out_);
  ASSERT_EQ(again.faces.size(), 2U);
  for (std::size_t i = 0; i < changed.control.size(); ++i) {
    EXPECT_NEAR((again.faces[1].face.surface.control[i] - changed.control[i]).norm(), 0, 1e-12);
    EXPECT_NEAR((again.faces[0].face.surface.control[i] - imported_.faces[0].face.surface.control[i]).norm(),
                0, 1e-12);
  }
}

TEST_F(CadBorders, ASeamThatOpenedIsTold) {
  const TopoDS_Face smooth = test::periodic_tube(30, 80);
  const Handle(Geom_BSplineSurface) tube =
      Handle(Geom_BSplineSurface)::DownCast(BRep_Tool::Surface(smooth)->Copy());
  tube->SetUNotPeriodic();
  // As stored: readers of files close such surfaces.
  const auto stored =
      detail::to_bytes({BRepBuilderAPI_MakeFace(tube, Precision::Confusion()).Face(), {}}, 1U << 20U);
  auto surface = detail::to_geometry(tube, {});
  ASSERT_TRUE(stored.ok() && surface.ok());
  models_.resize(1);
  models_[0].boundary_representation = std::make_shared<const std::string>(*stored);
  BSplineSurface changed = *surface;
  ASSERT_FALSE(changed.u.is_periodic());
  for (int j = 0; j < changed.v.control_count(); ++j) changed.control[changed.index(0, j)].y() += 0.001;
  models_[0].replaced = {{1, changed}};
  EXPECT_TRUE(written("step").valid);
  ASSERT_EQ(gaps_.size(), 1U);
  EXPECT_EQ(gaps_[0].face, gaps_[0].neighbour);
  const double v = changed.v.lower();
  const Vec3 across = changed.evaluate(changed.u.lower(), v) - changed.evaluate(changed.u.upper(), v);
  EXPECT_GT(across.norm(), 1e-4);
  EXPECT_NEAR(gaps_[0].gap_m, across.norm(), 1e-12);
}

/// Names every n-th entity of a kind in the text of a STEP file "word-n".
std::string named(const std::string& text, const std::string& entity, const std::string& word) {
  const std::regex empty(entity + "\\('[^']*'");
  std::string result;
  auto from = text.cbegin();
  int n = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), empty), end; it != end; ++it) {
    result.append(from, (*it)[0].first);
    result += entity + "('" + word + "-" + std::to_string(++n) + "'";
    from = (*it)[0].second;
  }
  return result.append(from, text.cend());
}

/// All that the stored model says of its parts, by kind and name, and how often.
std::multiset<std::string> said(const ImportedModel& model) {
  const auto stored = detail::from_bytes(model.boundary_representation);
  EXPECT_TRUE(stored.ok());
  std::multiset<std::string> all;
  if (!stored.ok()) return all;
  for (const detail::PartLabel& label : stored->labels) {
    std::string text = std::to_string(label.kind) + " " + label.name + " / " + label.product;
    if (label.colour) {
      for (const float part : *label.colour) text += " " + std::to_string(part).substr(0, 5);
    }
    all.insert(text);
  }
  return all;
}

class CadLabels : public CadBorders {
 protected:
  /// Two boxes of which all parts have names, and two faces colours.
  void use_named_boxes() {
    gp_Trsf aside;
    aside.SetTranslation(gp_Vec(300, 0, 0));
    test::write_step_file(in_, {test::box_with_freeform_top(100, 20),
                                test::box_with_freeform_top(100, -20).Moved(TopLoc_Location(aside))});
    std::string text = text_of(in_);
    text = named(text, "ADVANCED_FACE", "face");
    text = named(text, "MANIFOLD_SOLID_BREP", "solid");
    text = named(text, "CLOSED_SHELL", "shell");
    int n = 0;
    for (std::size_t at = 0; (at = text.find("PRODUCT('", at)) != std::string::npos; ++at) {
      const std::size_t end = text.find(",''", at);
      ASSERT_NE(end, std::string::npos);
      const std::string name = "'Part " + std::to_string(++n) + "'";
      text.replace(at, end - at, "PRODUCT(" + name + "," + name);
    }
    ASSERT_EQ(n, 2);
    std::smatch face;
    ASSERT_TRUE(std::regex_search(text, face, std::regex("(#[0-9]+) = ADVANCED_FACE\\('face-2'")));
    std::smatch context;
    ASSERT_TRUE(
        std::regex_search(text, context, std::regex("(#[0-9]+) = \\( GEOMETRIC_REPRESENTATION_CONTEXT")));
    const std::string styles =
        "#90001 = COLOUR_RGB('',0.25,0.5,0.75);\n"
        "#90002 = FILL_AREA_STYLE_COLOUR('',#90001);\n"
        "#90003 = FILL_AREA_STYLE('',(#90002));\n"
        "#90004 = SURFACE_STYLE_FILL_AREA(#90003);\n"
        "#90005 = SURFACE_SIDE_STYLE('',(#90004));\n"
        "#90006 = SURFACE_STYLE_USAGE(.BOTH.,#90005);\n"
        "#90007 = PRESENTATION_STYLE_ASSIGNMENT((#90006));\n"
        "#90008 = STYLED_ITEM('color',(#90007)," +
        face[1].str() +
        ");\n"
        "#90009 = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#90008)," +
        context[1].str() + ");\n";
    const std::size_t end = text.rfind("ENDSEC;");
    ASSERT_NE(end, std::string::npos);
    std::ofstream(in_, std::ios::binary) << text.insert(end, styles);
    use_file();
  }
};

TEST_F(CadLabels, NamesAndColoursComeIn) {
  use_named_boxes();
  const std::multiset<std::string> all = said(imported_);
  for (const char* name : {"face-1", "face-12", "solid-1", "solid-2", "shell-1", "Part 1", "Part 2"}) {
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const std::string& text) {
      return text.find(name) != std::string::npos;
    })) << name;
  }
  EXPECT_EQ(std::count_if(all.begin(), all.end(),
                          [](const std::string& text) {
                            return text.find("face-2 ") != std::string::npos &&
                                   text.find(" 0.") != std::string::npos;
                          }),
            1);
}

TEST_F(CadLabels, UntouchedModelsSayTheSameWhenTheyComeBack) {
  use_named_boxes();
  const StepContent after = written("step");
  EXPECT_TRUE(after.valid);
  std::multiset<std::string> expected = said(imported_);
  expected.insert("0  / model");  // Two products in one model make an assembly of its name.
  EXPECT_EQ(said(import(out_)), expected);
}

TEST_F(CadLabels, UntouchedFacesKeepNamesColoursAndShapeBesideChangedOnes) {
  use_named_boxes();
  ASSERT_EQ(imported_.faces.size(), 2U);
  replace(0, [](double, double) { return 0.002; });  // Opens the first box.
  const StepContent after = written("step");
  EXPECT_TRUE(after.valid);
  EXPECT_EQ(after.solids, 1U);
  ASSERT_EQ(after.faces.size(), before_.faces.size());
  std::map<std::string, const StepFace*> now;
  for (const StepFace& face : after.faces) now.emplace(face.name, &face);
  for (std::size_t i = 0; i < before_.faces.size(); ++i) {
    const StepFace& face = before_.faces[i];
    ASSERT_TRUE(now.contains(face.name)) << face.name;
    if (i + 1 == imported_.faces[0].number) continue;
    const StepFace& same = *now.at(face.name);
    ASSERT_EQ(same.samples.size(), face.samples.size());
    for (std::size_t k = 0; k < face.samples.size(); ++k) {
      EXPECT_NEAR((same.samples[k] - face.samples[k]).norm(), 0, 1e-12) << face.name;
    }
  }
  const ImportedModel again = import(out_);
  ASSERT_EQ(again.faces.size(), 2U);
  for (const ImportedFace& face : again.faces) {
    if (face.face.name != imported_.faces[1].face.name) continue;
    const auto& expected = imported_.faces[1].face.surface.control;
    ASSERT_EQ(face.face.surface.control.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_NEAR((face.face.surface.control[i] - expected[i]).norm(), 0, 1e-12);
    }
  }
  const std::multiset<std::string> all = said(again);
  const std::multiset<std::string> former = said(imported_);
  for (const std::string& text : former) {
    const bool is_face = text.find("face-") != std::string::npos;
    const bool is_second =
        text.find("solid-2") != std::string::npos || text.find("Part 2") != std::string::npos;
    if (is_face || is_second) {
      EXPECT_TRUE(all.contains(text)) << text;
    }
  }
  // The gaps bear the names that the file has.
  EXPECT_EQ(gaps_.size(), 4U);
  for (const BorderGap& gap : gaps_) {
    EXPECT_TRUE(gap.face_name.starts_with("face-")) << gap.face_name;
    EXPECT_TRUE(gap.neighbour_name.starts_with("face-")) << gap.neighbour_name;
    EXPECT_NEAR(gap.gap_m, 0.002, 1e-12);
  }
}

TEST_F(CadLabels, IgesKeepsEightCharactersOfAFacesName) {
  use_named_boxes();
  const StepContent after = written("igs");
  EXPECT_TRUE(after.valid);
  std::multiset<std::string> expected, found;
  for (const StepFace& face : before_.faces) expected.insert(face.name.substr(0, 8));
  for (const StepFace& face : after.faces) found.insert(face.name);
  EXPECT_EQ(found, expected);
}

TEST_F(CadLabels, ModelsOfFormerLogsHaveNone) {
  use(test::box_with_freeform_top(100, 20));
  const auto stored = detail::from_bytes(imported_.boundary_representation);
  ASSERT_TRUE(stored.ok());
  auto bare = detail::to_bytes({stored->shape, {}}, std::size_t{1} << 24U);
  ASSERT_TRUE(bare.ok());
  EXPECT_TRUE(detail::from_bytes(*bare)->labels.empty());
}

}  // namespace
}  // namespace handloft::exchange
