#pragma once
// Ownership of OpenGL 3.3 objects. Every call here needs a current context on the calling thread.

#include <epoxy/gl.h>

#include <glm/glm.hpp>
#include <span>
#include <string_view>
#include <utility>

#include "common/base/result.h"

namespace handloft::client {

/// A GL name that is deleted with its owner; moves, never copies.
template <typename Traits>
class GlObject {
 public:
  GlObject() = default;
  static GlObject create() {
    GlObject object;
    object.id_ = Traits::create();
    return object;
  }
  ~GlObject() { reset(); }
  GlObject(GlObject&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    if (this != &other) {
      reset();
      id_ = std::exchange(other.id_, 0);
    }
    return *this;
  }
  GlObject(const GlObject&) = delete;
  GlObject& operator=(const GlObject&) = delete;

  GLuint id() const { return id_; }
  explicit operator bool() const { return id_ != 0; }

 private:
  void reset() {
    if (id_ != 0) Traits::destroy(id_);
    id_ = 0;
  }
  GLuint id_ = 0;
};

struct GlTextureTraits {
  static GLuint create() {
    GLuint id = 0;
    glGenTextures(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteTextures(1, &id); }
};
struct GlBufferTraits {
  static GLuint create() {
    GLuint id = 0;
    glGenBuffers(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteBuffers(1, &id); }
};
struct GlVertexArrayTraits {
  static GLuint create() {
    GLuint id = 0;
    glGenVertexArrays(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteVertexArrays(1, &id); }
};
struct GlFramebufferTraits {
  static GLuint create() {
    GLuint id = 0;
    glGenFramebuffers(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteFramebuffers(1, &id); }
};

struct GlQueryTraits {
  static GLuint create() {
    GLuint id = 0;
    glGenQueries(1, &id);
    return id;
  }
  static void destroy(GLuint id) { glDeleteQueries(1, &id); }
};

using GlTexture = GlObject<GlTextureTraits>;
using GlBuffer = GlObject<GlBufferTraits>;
using GlVertexArray = GlObject<GlVertexArrayTraits>;
using GlFramebuffer = GlObject<GlFramebufferTraits>;
using GlQuery = GlObject<GlQueryTraits>;

/// A linked program of a vertex and a fragment shader, perhaps with a geometry shader between them. Unknown
/// uniform names are ignored, as GL does.
class GlProgram {
 public:
  GlProgram() = default;
  ~GlProgram();
  GlProgram(GlProgram&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  GlProgram& operator=(GlProgram&& other) noexcept;
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  /// Sources without a #version line. Errors: internal with the compiler's own log; `name` is in the message.
  static Result<GlProgram> build(std::string_view name, std::span<const std::string_view> vertex_parts,
                                 std::span<const std::string_view> fragment_parts,
                                 std::span<const std::string_view> geometry_parts = {});

  void use() const { glUseProgram(id_); }
  void set(const char* name, int value) const;
  void set(const char* name, float value) const;
  void set(const char* name, const glm::vec2& value) const;
  void set(const char* name, const glm::vec3& value) const;
  void set(const char* name, const glm::vec4& value) const;
  void set(const char* name, const glm::mat3& value) const;
  void set(const char* name, const glm::mat4& value) const;

 private:
  GLuint id_ = 0;
};

/// Binds `texture` of `target` to unit `unit`.
void bind_texture(int unit, GLenum target, GLuint texture);

}  // namespace handloft::client
