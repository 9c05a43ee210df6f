#pragma once
// The canonical form of a document and its SHA-256: equal documents give equal bytes on every machine,
// doubles bit by bit (X2). Independent of history, of clocks and of how the document came about.

#include <map>
#include <string>

#include "server-model/model/content_hash.h"
#include "server-model/model/document.h"

namespace handloft::model {

/// The hash of the canonical form, 64 lower-case hexadecimal digits. O(points); streams, so needs no second
/// copy.
std::string document_hash(const Document& document);

/// The canonical bytes themselves, little-endian, entities in ascending order of id; for tests and for
/// comparing.
std::string canonical_bytes(const Document& document);

/// SHA-256 of the canonical forms of entities, in hexadecimal digits: what a named version holds. Of an
/// entity that was seen before, nothing is read again. One thread; the entities must outlive it.
class EntityDigests {
 public:
  std::string of(const Entities& entities);

 private:
  std::map<const Entity*, ContentHash::Digest> seen_;
};

}  // namespace handloft::model
