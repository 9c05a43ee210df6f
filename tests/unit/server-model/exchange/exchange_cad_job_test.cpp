// What the process beside ours is asked and answers, as bytes: the same as if it were done here, and nothing
// but errors of what is cut off or damaged.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "common/record/crc32c.h"
#include "server-model/exchange/cad_bytes.h"
#include "server-model/exchange/cad_job.h"
#include "server-model/exchange/cad_wire.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/exchange/cad_models.h"

namespace handloft::exchange {
namespace {

/// Without the line that holds the time, and the library's numbers of uses, which go on from file to file.
std::string timeless(std::string text) {
  const std::size_t begin = text.find("FILE_NAME");
  if (begin != std::string::npos) text.erase(begin, text.find("FILE_SCHEMA") - begin);
  return std::regex_replace(text, std::regex("USAGE_OCCURRENCE\\('[0-9]*'"), "USAGE_OCCURRENCE(''");
}

template <typename T>
std::string bytes_of(const T& value) {
  detail::WireWriter wire;
  wire(value);
  return wire.take();
}

class CadJob : public ::testing::Test {
 protected:
  void SetUp() override {
    test::write_step_file(path_, {test::box_with_freeform_top(100, 20), test::rational_sphere(30),
                                  test::periodic_tube(20, 40), test::sheet_with_two_holes(100, 20)});
    auto model = import_cad_model(path_);
    ASSERT_TRUE(model.ok()) << model.error().describe();
    here_ = std::move(*model);
  }

  handloft::test::TemporaryDirectory folder_;
  std::filesystem::path path_ = folder_.path() / "model.step";
  ImportedModel here_;
  static constexpr Duration ample_ = std::chrono::minutes(10);
};

TEST_F(CadJob, AModelComesAsItDoesHere) {
  CadImportOptions options;
  const std::string answer = perform_cad_job(model_request(path_, options, ample_));
  const auto there = model_answer(answer);
  ASSERT_TRUE(there.ok()) << there.error().describe();
  ASSERT_GT(here_.faces.size(), 3U);
  EXPECT_EQ(bytes_of(*there), bytes_of(here_));
  EXPECT_EQ(there->faces.back().face.loops.size(), here_.faces.back().face.loops.size());
  options.max_faces = 2;
  options.max_model_bytes = 100'000'000;
  const auto refused = model_answer(perform_cad_job(model_request(path_, options, ample_)));
  const auto refused_here = import_cad_model(path_, options);
  ASSERT_FALSE(refused.ok() || refused_here.ok());
  EXPECT_EQ(refused.error().describe(), refused_here.error().describe());
}

TEST_F(CadJob, AReferenceComesAsItDoesHere) {
  ReferenceOptions options;
  options.translation = {0.1, 0.2, 0.3};
  const auto there = reference_answer(perform_cad_job(reference_request(path_, options)));
  const auto here = import_reference(path_, options);
  ASSERT_TRUE(there.ok() && here.ok());
  EXPECT_GT(there->indices.size(), 100U);
  EXPECT_EQ(bytes_of(*there), bytes_of(*here));
}

TEST_F(CadJob, FilesAreWrittenAsTheyAreHere) {
  SurfaceExport shell;
  shell.name = "Schale";
  std::vector<double> c(static_cast<std::size_t>(geometry::coefficient_count(3)));
  for (std::size_t k = 0; k < c.size(); ++k) c[k] = 0.012 * std::sin(1.0 + 2.0 * static_cast<double>(k));
  shell.surface = *geometry::PolynomialSurface::from_scaled(3, {{0.01, 0.02}, {0.06, 0.04}}, c);
  shell.frame.origin = {0.1, -0.05, 0.2};
  shell.superellipse = *geometry::Superellipse::create({{0.01, 0.02}, {0.06, 0.04}}, 2.7);
  std::vector<CadFace> faces;
  for (const ImportedFace& face : here_.faces) faces.push_back(face.face);
  ModelExport model;
  model.name = "all";
  model.boundary_representation = std::make_shared<const std::string>(here_.boundary_representation);
  model.replaced.push_back({here_.faces[0].number, here_.faces[0].face.surface});
  for (geometry::Vec3& p : model.replaced[0].surface.control) p.z() += 0.01;
  const CadContent content{{&shell, 1}, faces, {&model, 1}};
  for (const CadTextFormat format : {CadTextFormat::step, CadTextFormat::iges}) {
    StepOptions options;
    options.author = "Ada";
    const auto there = text_answer(perform_cad_job(text_request(format, "a.step", content, options)));
    const auto here = CadKernel().text(format, "a.step", content, options);
    ASSERT_TRUE(there.ok() && here.ok()) << (there.ok() ? "" : there.error().describe());
    EXPECT_NE(there->text.find("Ada"), std::string::npos);
    if (format == CadTextFormat::step) {
      EXPECT_TRUE(timeless(there->text) == timeless(here->text)) << "they are long";
    } else {
      EXPECT_EQ(there->text.size(), here->text.size()) << "they differ in the time only";
    }
    EXPECT_FALSE(here->gaps.empty()) << "the moved top came apart from its sides";
    EXPECT_EQ(bytes_of(there->gaps), bytes_of(here->gaps));
  }
}

TEST_F(CadJob, DamagedAnswersAreErrorsOrValuesWithinTheirBounds) {
  const std::string good = perform_cad_job(model_request(path_, {}, ample_));
  ASSERT_TRUE(model_answer(good).ok());
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    EXPECT_FALSE(model_answer(good.substr(0, random() % good.size())).ok()) << i;
    std::string bytes = good;
    for (int k = 0; k < 20; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    const auto answer = model_answer(bytes);
    if (answer.ok()) {
      EXPECT_LE(answer->rest_positions.size(), bytes.size());
    }
    std::string noise(random() % 500, ' ');
    for (char& byte : noise) byte = static_cast<char>(random());
    static_cast<void>(reference_answer(noise).ok());
    static_cast<void>(text_answer(noise).ok());
  }
  EXPECT_FALSE(model_answer("").ok());
  EXPECT_FALSE(model_answer(good + "x").ok());
  EXPECT_FALSE(text_answer(perform_cad_job("")).ok());
  EXPECT_FALSE(text_answer(perform_cad_job("\xFF")).ok());
  const std::string request = model_request(path_, {}, ample_);
  EXPECT_FALSE(model_answer(perform_cad_job(request.substr(0, request.size() - 3))).ok());
}

// Logs hold models from before there were labels.
TEST_F(CadJob, ModelsStoredBeforeThereWereLabelsAreReadAndWritten) {
  constexpr std::size_t header_bytes = 20;
  const auto kept = detail::from_bytes(here_.boundary_representation);
  ASSERT_TRUE(kept.ok());
  const auto bare = detail::to_bytes({kept->shape, {}}, std::size_t{1} << 30U);
  ASSERT_TRUE(bare.ok());
  const std::string body = bare->substr(header_bytes + 4);  // Less the count of labels.
  std::string old = "HLBREP1\n";
  for (std::size_t i = 0; i < 8; ++i) old.push_back(static_cast<char>((body.size() >> (8 * i)) & 0xFFU));
  const std::uint32_t sum = record::crc32c({reinterpret_cast<const std::uint8_t*>(body.data()), body.size()});
  for (std::size_t i = 0; i < 4; ++i) old.push_back(static_cast<char>((sum >> (8 * i)) & 0xFFU));
  old += body;

  const auto read = detail::from_bytes(old);
  ASSERT_TRUE(read.ok()) << read.error().describe();
  EXPECT_TRUE(read->labels.empty());
  ModelExport model;
  model.boundary_representation = std::make_shared<const std::string>(old);
  model.replaced.push_back({here_.faces[0].number, here_.faces[0].face.surface});
  const CadContent content{{}, {}, {&model, 1}};
  const std::filesystem::path out = folder_.path() / "out.step";
  const Status written = write_step(out, content);
  ASSERT_TRUE(written.ok()) << written.error().describe();
  const auto again = import_cad_model(out);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->face_count, here_.face_count);
  old.back() = static_cast<char>(old.back() ^ 1);
  EXPECT_FALSE(detail::from_bytes(old).ok());
}

}  // namespace
}  // namespace handloft::exchange
