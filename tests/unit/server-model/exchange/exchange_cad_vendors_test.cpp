// Files as other vendors write them: what our kernel does not know of them is left out with a note, and only
// damaged geometry is refused.

#include <gtest/gtest.h>

#include <BRep_Builder.hxx>
#include <Interface_Static.hxx>
#include <STEPControl_Writer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS_Compound.hxx>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <gp_Trsf.hxx>
#include <iterator>
#include <regex>
#include <string>

#include "server-model/exchange/cad_import.h"
#include "server-model/exchange/reference_import.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/exchange/cad_models.h"

namespace handloft::exchange {
namespace {

using geometry::Vec3;

class VendorStep : public ::testing::Test {
 protected:
  void SetUp() override {
    test::write_step_file(path_, {test::box_with_freeform_top(100, 20)});
    std::ifstream stream(path_);
    text_ = {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  /// Puts lines at the end of the data.
  void append(const std::string& lines) { text_.insert(text_.rfind("ENDSEC;"), lines); }
  void replace(const std::string& what, const std::string& by) {
    const std::size_t at = text_.find(what);
    ASSERT_NE(at, std::string::npos) << what;
    text_.replace(at, what.size(), by);
  }
  void replace_all(const std::string& pattern, const std::string& by) {
    text_ = std::regex_replace(text_, std::regex(pattern), by);
  }
  Result<ImportedModel> import() {
    std::ofstream(path_) << text_;
    return import_cad_model(path_);
  }
  /// That all six faces came, and where the top is, in metres.
  void expect_the_box(const Result<ImportedModel>& model, double size_m = 0.1) {
    ASSERT_TRUE(model.ok()) << model.error().describe();
    EXPECT_EQ(model->face_count, 6U);
    ASSERT_EQ(model->faces.size(), 1U);
    const auto& surface = model->faces[0].face.surface;
    EXPECT_NEAR((surface.control.back() - surface.control.front()).norm(), std::sqrt(2.0) * size_m,
                1e-9 * size_m);
  }

  handloft::test::TemporaryDirectory folder_;
  std::filesystem::path path_ = folder_.path() / "part.step";
  std::string text_;
};

TEST_F(VendorStep, IsWhole) {
  const auto model = import();
  expect_the_box(model);
  EXPECT_TRUE(model->notes.empty()) << model->notes[0];
}

TEST_F(VendorStep, CommentsBlankLinesAndOtherLineEndsDoNotMatter) {
  replace("DATA;",
          "DATA;\n/* written by a program\n   with much to say: #5 = CARTESIAN_POINT('',(NaN)); */\n\n");
  replace_all("\n", "\r\n");
  const auto model = import();
  expect_the_box(model);
  EXPECT_TRUE(model->notes.empty()) << model->notes[0];
}

TEST_F(VendorStep, TypesThatNobodyKnowsAreLeftOut) {
  append(
      "#90001 = VENDOR_FEATURE_TREE('Pad.1',#10,(1.,2.),.T.,$);\n"
      "#90002 = ( VENDOR_A('x') VENDOR_B(#90001) );\n");
  expect_the_box(import());
}

// AP242's product and manufacturing information and tessellations, some of which is younger than the kernel.
TEST_F(VendorStep, AnnotationsAreLeftOut) {
  append(
      "#90001 = SHAPE_ASPECT('','',#4,.T.);\n"
      "#90002 = DIMENSIONAL_SIZE(#90001,'diameter');\n"
      "#90003 = DRAUGHTING_CALLOUT('GDT',(#90004));\n"
      "#90004 = TESSELLATED_ANNOTATION_OCCURRENCE('',(),#90005);\n"
      "#90005 = REPOSITIONED_TESSELLATED_ITEM('',(),#90006);\n"
      "#90006 = AXIS2_PLACEMENT_3D('',#90007,$,$);\n"
      "#90007 = CARTESIAN_POINT('',(0.,0.,0.));\n"
      "#90008 = CHARACTERIZED_ITEM_WITHIN_REPRESENTATION('','',#90006,$);\n");
  expect_the_box(import());
}

TEST_F(VendorStep, WhatIsMissingOrWrongInProductsIsLeftOutWithANote) {
  replace_all("PRODUCT\\('[^']*',\\s*'[^']*',\\s*'[^']*',", "PRODUCT($,5,$,");
  const auto model = import();
  expect_the_box(model);
  ASSERT_EQ(model->notes.size(), 1U);
  EXPECT_NE(model->notes[0].find("besides the geometry that cannot be read"), std::string::npos)
      << model->notes[0];
}

TEST_F(VendorStep, ReferencesToNothingFromWhatIsNoGeometryAreLeftOut) {
  append(
      "#90001 = PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#99999));\n"
      "#90002 = GENERAL_PROPERTY('','weight',$);\n"
      "#90003 = PROPERTY_DEFINITION('','',#99998);\n");
  expect_the_box(import());
}

TEST_F(VendorStep, DamagedGeometryIsRefusedByName) {
  replace("CARTESIAN_POINT('',(", "CARTESIAN_POINT('',(.TRUE.,");
  const auto model = import();
  ASSERT_FALSE(model.ok());
  EXPECT_EQ(model.error().code, ErrorCode::data_corrupt);
  EXPECT_NE(model.error().message.find("geometric entities that are damaged"), std::string::npos)
      << model.error().message;
  EXPECT_FALSE(import_reference(path_).ok());
}

TEST_F(VendorStep, MetresAndCentimetresBecomeMetres) {
  replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)");
  expect_the_box(import(), 100);
  replace("SI_UNIT($,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)");
  expect_the_box(import(), 1);
}

TEST_F(VendorStep, AFileWithoutAUnitIsTakenForMillimetresWithANote) {
  replace_all("GLOBAL_UNIT_ASSIGNED_CONTEXT\\s*\\(\\([^)]*\\)\\s*\\)", "GLOBAL_UNIT_ASSIGNED_CONTEXT(())");
  const auto model = import();
  expect_the_box(model);
  EXPECT_TRUE(std::any_of(model->notes.begin(), model->notes.end(), [](const std::string& note) {
    return note.find("no unit of length") != std::string::npos;
  }));
}

TEST_F(VendorStep, AssembliesWithinAssembliesComeWholeAndInPlace) {
  const auto moved = [](const TopoDS_Shape& shape, double x) {
    gp_Trsf by;
    by.SetTranslation(gp_Vec(x, 0, 0));
    return shape.Moved(TopLoc_Location(by));
  };
  const auto pair_of = [](const TopoDS_Shape& a, const TopoDS_Shape& b) {
    TopoDS_Compound pair;
    const BRep_Builder builder;
    builder.MakeCompound(pair);
    builder.Add(pair, a);
    builder.Add(pair, b);
    return pair;
  };
  const TopoDS_Shape box = test::box_with_freeform_top(100, 20);
  const TopoDS_Shape pair = pair_of(box, moved(box, 200));
  STEPControl_Writer writer;
  Interface_Static::SetIVal("write.step.assembly", 1);
  writer.Transfer(pair_of(pair, moved(pair, 1000)), STEPControl_AsIs);
  Interface_Static::SetIVal("write.step.assembly", 0);
  ASSERT_EQ(writer.Write(path_.c_str()), IFSelect_RetDone);
  const auto model = import_cad_model(path_);
  ASSERT_TRUE(model.ok()) << model.error().describe();
  EXPECT_EQ(model->face_count, 24U);
  ASSERT_EQ(model->faces.size(), 4U);
  std::vector<double> places;
  for (const ImportedFace& face : model->faces) {
    double least = face.face.surface.control[0].x();
    for (const Vec3& p : face.face.surface.control) least = std::min(least, p.x());
    places.push_back(least);
  }
  std::sort(places.begin(), places.end());
  const double first = places[0];
  EXPECT_NEAR(places[1] - first, 0.2, 1e-9);
  EXPECT_NEAR(places[2] - first, 1.0, 1e-9);
  EXPECT_NEAR(places[3] - first, 1.2, 1e-9);
}

}  // namespace
}  // namespace handloft::exchange
