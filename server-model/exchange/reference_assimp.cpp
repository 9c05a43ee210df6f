// The border to Assimp: only the four readers that we name, only files that we hold in memory, and no
// exception beyond it. None of its later steps is used: they trust what the readers leave.

#include <fmt/format.h>

#include <assimp/BaseImporter.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/importerdesc.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <exception>
#include <memory>
#include <string_view>
#include <utility>

#include "server-model/exchange/raw_triangles.h"

namespace handloft::exchange::detail {
namespace {

class MemoryFiles : public Assimp::IOSystem {
 public:
  explicit MemoryFiles(const FilesInMemory& files) : files_(files) {}

  bool Exists(const char* name) const override { return files_.find(plain(name)) != files_.end(); }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* mode) override {
    const auto found = files_.find(plain(name));
    if (found == files_.end() || std::string_view(mode).find('w') != std::string_view::npos) return nullptr;
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(found->second.data()),
                                      found->second.size(), false);
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  static std::string_view plain(std::string_view name) {
    return name.substr(0, 2) == "./" ? name.substr(2) : name;
  }
  const FilesInMemory& files_;
};

bool is_ours(const aiImporterDesc& description, std::string_view hint) {
  // Listed by extension, parted by spaces. The reader of glTF 1 shares its extension with that of glTF 2.
  if (hint == "gltf") return std::string_view(description.mName).substr(0, 5) == "glTF2";
  std::string_view all = description.mFileExtensions;
  while (!all.empty()) {
    const std::size_t end = std::min(all.find(' '), all.size());
    if (all.substr(0, end) == hint) return true;
    all.remove_prefix(std::min(end + 1, all.size()));
  }
  return false;
}

/// Leaves one reader: Assimp looks into a file with others when the one of its extension refuses it.
void keep_only(Assimp::Importer& importer, std::string_view hint) {
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    const aiImporterDesc* description = importer.GetImporterInfo(i);
    if (description != nullptr && is_ours(*description, hint)) continue;
    const std::unique_ptr<Assimp::BaseImporter> other(importer.GetImporter(i));
    importer.UnregisterLoader(other.get());
  }
}

struct Placed {
  const aiNode* node;
  aiMatrix4x4 world_from_parent;
};

Status append_mesh(const aiMesh& mesh, const aiMatrix4x4& world_from_node, RawTriangles& into,
                   const ReferenceOptions& options) {
  if (mesh.mVertices == nullptr || mesh.mFaces == nullptr) return {};
  Status counts = check_counts(into.positions.size() + mesh.mNumVertices,
                               into.indices.size() / 3 + mesh.mNumFaces, options);
  if (!counts) return counts;
  const auto base = static_cast<std::uint32_t>(into.positions.size());
  const bool turned_over = world_from_node.Determinant() < 0;
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D p = world_from_node * mesh.mVertices[i];
    into.positions.emplace_back(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
  }
  std::vector<std::uint32_t> corners;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices < 3) continue;
    corners.assign(face.mIndices, face.mIndices + face.mNumIndices);
    for (std::uint32_t& corner : corners) {
      if (corner >= mesh.mNumVertices) {
        return make_error(
            ErrorCode::data_corrupt,
            fmt::format("face {} names vertex {}, expected below {}", f, corner, mesh.mNumVertices), "path");
      }
      corner += base;
    }
    if (turned_over) std::reverse(corners.begin(), corners.end());
    append_polygon(corners, into);
    if (into.indices.size() / 3 > options.max_triangles) {
      return check_counts(into.positions.size(), into.indices.size() / 3, options);
    }
  }
  return {};
}

Result<RawTriangles> flatten(const aiScene& scene, const ReferenceOptions& options) {
  RawTriangles result;
  std::vector<Placed> open{{scene.mRootNode, aiMatrix4x4()}};
  while (!open.empty()) {
    const Placed at = open.back();
    open.pop_back();
    const aiMatrix4x4 world_from_node = at.world_from_parent * at.node->mTransformation;
    for (unsigned i = 0; i < at.node->mNumMeshes; ++i) {
      if (at.node->mMeshes[i] >= scene.mNumMeshes) {
        return make_error(ErrorCode::data_corrupt, "a node names a mesh that does not exist", "path");
      }
      Status status = append_mesh(*scene.mMeshes[at.node->mMeshes[i]], world_from_node, result, options);
      if (!status) return status.error();
    }
    for (unsigned i = at.node->mNumChildren; i-- > 0;) {
      open.push_back({at.node->mChildren[i], world_from_node});
    }
  }
  return result;
}

}  // namespace

Result<RawTriangles> read_with_assimp(const FilesInMemory& files, const std::string& main,
                                      const std::string& hint, const ReferenceOptions& options) {
  try {
    Assimp::Importer importer;
    keep_only(importer, hint);
    importer.SetIOHandler(new MemoryFiles(files));  // Owned by the importer from here.
    const aiScene* scene = importer.ReadFile(main, 0);
    if (scene == nullptr || scene->mRootNode == nullptr) {
      std::string reason = importer.GetErrorString();
      for (char& c : reason) {
        if (static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~') c = ' ';
      }
      constexpr std::size_t longest = 200;
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("found no mesh that can be read, expected a .{} file: {}", hint,
                                    reason.empty() ? "no reason given" : reason.substr(0, longest)),
                        "path");
    }
    return flatten(*scene, options);
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::resource_exhausted, "reading the mesh ran out of memory", "path");
  } catch (const std::exception& exception) {
    return make_error(ErrorCode::data_corrupt, fmt::format("reading the mesh failed: {}", exception.what()),
                      "path");
  }
}

}  // namespace handloft::exchange::detail
