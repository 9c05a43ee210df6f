#include "client-hmd/render/gl.h"

#include <glm/gtc/type_ptr.hpp>
#include <string>
#include <vector>

namespace handloft::client {
namespace {

Result<GLuint> compile(GLenum stage, std::string_view name, std::span<const std::string_view> parts) {
  constexpr std::string_view version = "#version 330 core\n";
  std::vector<const char*> sources{version.data()};
  std::vector<GLint> lengths{static_cast<GLint>(version.size())};
  for (const std::string_view part : parts) {
    sources.push_back(part.data());
    lengths.push_back(static_cast<GLint>(part.size()));
  }
  const GLuint shader = glCreateShader(stage);
  glShaderSource(shader, static_cast<GLsizei>(sources.size()), sources.data(), lengths.data());
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  std::string log(4096, '\0');
  GLsizei length = 0;
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(static_cast<std::size_t>(length));
  glDeleteShader(shader);
  return make_error(ErrorCode::internal, "shader " + std::string(name) + " does not compile: " + log);
}

}  // namespace

GlProgram::~GlProgram() {
  if (id_ != 0) glDeleteProgram(id_);
}

GlProgram& GlProgram::operator=(GlProgram&& other) noexcept {
  if (this != &other) {
    if (id_ != 0) glDeleteProgram(id_);
    id_ = std::exchange(other.id_, 0);
  }
  return *this;
}

Result<GlProgram> GlProgram::build(std::string_view name, std::span<const std::string_view> vertex_parts,
                                   std::span<const std::string_view> fragment_parts,
                                   std::span<const std::string_view> geometry_parts) {
  struct Stage {
    GLenum kind;
    std::span<const std::string_view> parts;
  };
  GlProgram program;
  program.id_ = glCreateProgram();
  for (const Stage& stage : {Stage{GL_VERTEX_SHADER, vertex_parts}, Stage{GL_GEOMETRY_SHADER, geometry_parts},
                             Stage{GL_FRAGMENT_SHADER, fragment_parts}}) {
    if (stage.parts.empty()) continue;
    const Result<GLuint> shader = compile(stage.kind, name, stage.parts);
    if (!shader) return shader.error();
    glAttachShader(program.id_, *shader);
    glDeleteShader(*shader);  // It goes with the program.
  }
  glLinkProgram(program.id_);
  GLint linked = GL_FALSE;
  glGetProgramiv(program.id_, GL_LINK_STATUS, &linked);
  if (linked == GL_TRUE) return program;
  std::string log(4096, '\0');
  GLsizei length = 0;
  glGetProgramInfoLog(program.id_, static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(static_cast<std::size_t>(length));
  return make_error(ErrorCode::internal, "program " + std::string(name) + " does not link: " + log);
}

void GlProgram::set(const char* name, int value) const {
  glUniform1i(glGetUniformLocation(id_, name), value);
}
void GlProgram::set(const char* name, float value) const {
  glUniform1f(glGetUniformLocation(id_, name), value);
}
void GlProgram::set(const char* name, const glm::vec2& value) const {
  glUniform2fv(glGetUniformLocation(id_, name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::vec3& value) const {
  glUniform3fv(glGetUniformLocation(id_, name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::vec4& value) const {
  glUniform4fv(glGetUniformLocation(id_, name), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::mat3& value) const {
  glUniformMatrix3fv(glGetUniformLocation(id_, name), 1, GL_FALSE, glm::value_ptr(value));
}
void GlProgram::set(const char* name, const glm::mat4& value) const {
  glUniformMatrix4fv(glGetUniformLocation(id_, name), 1, GL_FALSE, glm::value_ptr(value));
}

void bind_texture(int unit, GLenum target, GLuint texture) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(target, texture);
  // Whoever makes a texture binds it to the active unit: never to one that something was left in for later.
  if (unit != 0) glActiveTexture(GL_TEXTURE0);
}

}  // namespace handloft::client
