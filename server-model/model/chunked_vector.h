#pragma once
// A persistent vector that only grows: copies share their elements, and appending to a copy costs the
// appended elements alone. A gesture that adds one point a frame to a cloud of 100,000 thus copies neither
// the cloud nor what history keeps of it (architecture idea 3; bench_model_document guards the cost).

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

namespace handloft::model {

/// Value semantics; T must be trivially copyable. A value is safe to read from many threads, and two copies
/// may be appended to from two threads: they claim the free slots of a shared chunk atomically, and who comes
/// second copies that one chunk.
template <typename T, std::size_t ChunkSize = 1024>
class ChunkedVector {
  static_assert(std::is_trivially_copyable_v<T>);

 private:
  struct Chunk {
    std::atomic<std::size_t> claimed{0};
    std::array<T, ChunkSize> items;
  };
  using Chunks = std::vector<std::shared_ptr<Chunk>>;

 public:
  static constexpr std::size_t chunk_size = ChunkSize;

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  /// Precondition: i < size().
  const T& operator[](std::size_t i) const {
    assert(i < size_);
    return (*(*chunks_)[i / ChunkSize]).items[i % ChunkSize];
  }
  const T& back() const { return (*this)[size_ - 1]; }

  std::size_t chunk_count() const { return (size_ + ChunkSize - 1) / ChunkSize; }
  /// The elements [index * ChunkSize, min(size, (index + 1) * ChunkSize)).
  std::span<const T> chunk(std::size_t index) const {
    assert(index < chunk_count());
    return {(*(*chunks_)[index]).items.data(), std::min(ChunkSize, size_ - index * ChunkSize)};
  }

  void push_back(const T& item) { append(std::span<const T>(&item, 1)); }

  void append(std::span<const T> items) {
    while (!items.empty()) {
      const std::size_t used = size_ % ChunkSize;
      if (used == 0) {
        add_chunk(std::make_shared<Chunk>());
      }
      const std::size_t count = std::min(ChunkSize - used, items.size());
      std::shared_ptr<Chunk> tail = chunks_->back();
      std::size_t expected = used;
      if (!tail->claimed.compare_exchange_strong(expected, used + count, std::memory_order_acq_rel)) {
        // Another copy has grown into this chunk: continue in a chunk of our own.
        tail = copy_of(*tail, used, used + count);
        replace_last(tail);
      }
      std::copy_n(items.begin(), count, tail->items.begin() + static_cast<std::ptrdiff_t>(used));
      size_ += count;
      items = items.subspan(count);
    }
  }

  /// A chunk on its own, to build again what copies shared (document_codec.h).
  class Block {
   public:
    /// Precondition: 1..ChunkSize items.
    explicit Block(std::span<const T> items) : chunk_(std::make_shared<Chunk>()), size_(items.size()) {
      assert(!items.empty() && items.size() <= ChunkSize);
      std::copy(items.begin(), items.end(), chunk_->items.begin());
      chunk_->claimed.store(items.size(), std::memory_order_relaxed);
    }
    std::size_t size() const { return size_; }

   private:
    friend class ChunkedVector;
    std::shared_ptr<Chunk> chunk_;
    std::size_t size_;
  };

  /// The first `size` elements of the blocks, which are shared. Precondition: every block but the last is
  /// full, the last holds what remains or more.
  static ChunkedVector of_blocks(std::span<const Block> blocks, std::size_t size) {
    assert((size + ChunkSize - 1) / ChunkSize == blocks.size());
    ChunkedVector result;
    if (size == 0) return result;
    auto list = std::make_shared<Chunks>();
    list->reserve(blocks.size());
    for (const Block& block : blocks) list->push_back(block.chunk_);
    result.chunks_ = std::move(list);
    result.size_ = size;
    return result;
  }

  /// A copy with element i replaced; only its chunk is copied. Precondition: i < size().
  ChunkedVector with(std::size_t i, const T& item) const {
    assert(i < size_);
    const std::size_t index = i / ChunkSize;
    const std::size_t used = chunk(index).size();
    ChunkedVector result = *this;
    auto list = std::make_shared<Chunks>(chunks_->begin(),
                                         chunks_->begin() + static_cast<std::ptrdiff_t>(chunk_count()));
    (*list)[index] = copy_of(*(*list)[index], used, used);
    (*list)[index]->items[i % ChunkSize] = item;
    result.chunks_ = std::move(list);
    return result;
  }

  /// A copy with the elements at `indices` (ascending) replaced by `items`; only their chunks are copied.
  /// Precondition: indices below size(), as many items.
  ChunkedVector with(std::span<const std::size_t> indices, std::span<const T> items) const {
    assert(indices.size() == items.size());
    ChunkedVector result = *this;
    if (indices.empty()) return result;
    auto list = std::make_shared<Chunks>(chunks_->begin(),
                                         chunks_->begin() + static_cast<std::ptrdiff_t>(chunk_count()));
    std::size_t last = chunk_count();
    for (std::size_t k = 0; k < indices.size(); ++k) {
      assert(indices[k] < size_);
      const std::size_t index = indices[k] / ChunkSize;
      if (index != last) {
        const std::size_t used = chunk(index).size();
        (*list)[index] = copy_of(*(*list)[index], used, used);
        last = index;
      }
      (*list)[index]->items[indices[k] % ChunkSize] = items[k];
    }
    result.chunks_ = std::move(list);
    return result;
  }

  /// True when both hold the very same memory: equal without looking. (False says nothing.)
  bool shares_all_with(const ChunkedVector& other) const {
    return size_ == other.size_ && (size_ == 0 || chunks_ == other.chunks_);
  }

  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = T;
    using difference_type = std::ptrdiff_t;
    using pointer = const T*;
    using reference = const T&;
    Iterator() = default;
    Iterator(const ChunkedVector* vector, std::size_t index) : vector_(vector), index_(index) {}
    reference operator*() const { return (*vector_)[index_]; }
    pointer operator->() const { return &(*vector_)[index_]; }
    Iterator& operator++() {
      ++index_;
      return *this;
    }
    Iterator operator++(int) { return Iterator(vector_, index_++); }
    bool operator==(const Iterator& other) const { return index_ == other.index_; }

   private:
    const ChunkedVector* vector_ = nullptr;
    std::size_t index_ = 0;
  };
  Iterator begin() const { return Iterator(this, 0); }
  Iterator end() const { return Iterator(this, size_); }

 private:
  static std::shared_ptr<Chunk> copy_of(const Chunk& from, std::size_t used, std::size_t claimed) {
    auto chunk = std::make_shared<Chunk>();
    std::copy_n(from.items.begin(), used, chunk->items.begin());
    chunk->claimed.store(claimed, std::memory_order_relaxed);
    return chunk;
  }

  // The list of chunks is shared too; it is copied once a chunk, never once an element.
  void add_chunk(std::shared_ptr<Chunk> chunk) {
    auto list = std::make_shared<Chunks>();
    const std::size_t kept = chunk_count();
    list->reserve(kept + 1);
    if (chunks_) list->assign(chunks_->begin(), chunks_->begin() + static_cast<std::ptrdiff_t>(kept));
    list->push_back(std::move(chunk));
    chunks_ = std::move(list);
  }

  void replace_last(std::shared_ptr<Chunk> chunk) {
    auto list = std::make_shared<Chunks>(*chunks_);
    list->back() = std::move(chunk);
    chunks_ = std::move(list);
  }

  std::shared_ptr<const Chunks> chunks_;
  std::size_t size_ = 0;
};

}  // namespace handloft::model
