#include "tests/integration/client-hmd/golden_designs.h"

#include <google/protobuf/util/json_util.h>

#include <fstream>
#include <map>
#include <sstream>

#include "client-hmd/mirror/control_net_asker.h"
#include "client-hmd/mirror/scene_mirror.h"
#include "server-model/session/local_target.h"
#include "server-model/session/script_runner.h"
#include "server-model/stream/mesh_cache.h"
#include "server-model/stream/scene_builder.h"
#include "server-model/stream/viewer.h"

namespace handloft::client::test {
namespace {

constexpr const char* folder = "tests/data/scripts";

bool changes_nothing(const std::string& line) {
  return line.starts_with("{\"expect\"") || line.starts_with("{\"export\"") || line.starts_with("{\"query\"");
}

Result<model::Model> run(const Design& design) {
  std::ifstream file(std::string(folder) + "/" + design.script + ".jsonl");
  if (!file) return make_error(ErrorCode::not_found, "no script " + design.script);
  std::stringstream operations;
  for (std::string line; std::getline(file, line);) {
    if (!changes_nothing(line)) operations << line << '\n';
  }
  for (const std::string& line : design.more) operations << line << '\n';
  model::FileAccess files;
  files.read_folder = folder;
  model::LocalTarget target(files);
  std::ostringstream answers;
  const model::ScriptSummary summary = model::run_script(operations, answers, target);
  if (!summary.ok()) {
    return make_error(ErrorCode::internal, design.script + ": " + summary.first_failure);
  }
  return std::move(target).take_model();
}

/// The gesture in the air, if there is one.
Status begin_gesture(const Design& design, model::Model& model) {
  if (design.in_the_air.empty()) return {};
  v1::Operation operation;
  if (!google::protobuf::util::JsonStringToMessage(design.in_the_air, &operation).ok()) {
    return make_error(ErrorCode::invalid_argument, "not an operation: " + design.in_the_air);
  }
  operation.set_client_id(design.by);
  const auto begun = model.begin_provisional(operation);
  return begun ? Status() : Status(begun.error());
}

/// As the server sends it and the client takes it: what stands first, then the gesture.
Result<std::shared_ptr<const Scene>> streamed(model::Model& model, const Design& design) {
  stream::MeshCache meshes([](const std::function<void()>& job) { job(); }, [] {});
  stream::SceneBuilder builder(1, meshes);
  stream::HandMarks marks;
  if (!design.selected.empty()) marks.active = {design.selected};
  marks.targets = design.targets;
  stream::Viewer viewer;
  SceneMirror mirror;
  for (const bool gesture : {false, true}) {
    if (gesture) {
      if (const Status begun = begin_gesture(design, model); !begun) return begun.error();
    }
    // The first build asks for the meshes, the second has them.
    (void)builder.build(model, 0, marks);
    const stream::ScenePtr complete = builder.build(model, 0, marks);
    while (const auto envelope = viewer.next(*complete)) {
      v1::Envelope received;
      if (!received.ParseFromString(envelope->SerializeAsString())) {
        return make_error(ErrorCode::data_corrupt, "a message does not survive its bytes");
      }
      const Status applied =
          received.has_snapshot() ? mirror.apply(received.snapshot()) : mirror.apply(received.delta());
      if (!applied) return applied.error();
    }
  }
  return mirror.scene();
}

}  // namespace

Result<std::shared_ptr<const Scene>> design_scene(const Design& design) {
  static std::map<Design, std::shared_ptr<const Scene>> made;
  if (const auto found = made.find(design); found != made.end()) return found->second;
  Result<model::Model> model = run(design);
  if (!model) return model.error();
  Result<std::shared_ptr<const Scene>> scene = streamed(*model, design);
  if (scene) made.emplace(design, *scene);
  return scene;
}

Result<ControlNets> design_nets(const Design& design) {
  Result<model::Model> model = run(design);
  if (!model) return model.error();
  const Result<std::shared_ptr<const Scene>> scene = streamed(*model, design);
  if (!scene) return scene.error();
  ControlNetAsker asker;
  for (const v1::Envelope& question : asker.questions(**scene)) {
    v1::Answer answer;
    answer.set_request(question.ask().request());
    const Result<v1::QueryResult> result = model->query(question.ask().query());
    if (result) {
      *answer.mutable_result() = *result;
    } else {
      answer.mutable_failure()->set_message(result.error().message);
    }
    (void)asker.take(answer);
  }
  return asker.nets();
}

std::shared_ptr<const Scene> shown_as(const Scene& scene, Representation representation) {
  auto copy = std::make_shared<Scene>(scene);
  for (auto& [id, entity] : copy->entities) {
    auto other = std::make_shared<Entity>(*entity);
    other->representation = representation;
    entity = other;
  }
  return copy;
}

std::shared_ptr<const Scene> changed(const Scene& scene, const std::string& id,
                                     const std::function<void(Entity&)>& change) {
  auto copy = std::make_shared<Scene>(scene);
  const auto found = copy->entities.find(id);
  if (found == copy->entities.end()) return copy;
  auto other = std::make_shared<Entity>(*found->second);
  change(*other);
  found->second = other;
  return copy;
}

}  // namespace handloft::client::test
