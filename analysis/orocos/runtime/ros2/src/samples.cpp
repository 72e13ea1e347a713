#include "samples.hpp"

#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

namespace mauve {
namespace {

struct SampleType : ddsi_sertype {
  Arrivals* arrivals;
};

// Followed by its bytes, filled up to a multiple of four: Cyclone sends them in such pieces.
struct Sample : ddsi_serdata {
  // Without what fills it up.
  std::size_t size;
  char* bytes() { return reinterpret_cast<char*>(this + 1); }
};

Sample& sample(const ddsi_serdata* data) { return *const_cast<Sample*>(static_cast<const Sample*>(data)); }

Sample* allocate(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) {
  const std::size_t filled = (size + 3) / 4 * 4;
  void* const memory = std::malloc(sizeof(Sample) + filled);
  if (memory == nullptr) return nullptr;
  Sample* const made = new (memory) Sample();
  ddsi_serdata_init(made, type, kind);
  made->hash = type == nullptr ? 0 : type->serdata_basehash;
  made->size = size;
  std::memset(made->bytes() + size, 0, filled - size);
  return made;
}

// Null where the sample is too large, or not of a topic at all.
Sample* allocate_arrived(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) {
  Arrivals& arrivals = *static_cast<const SampleType*>(type)->arrivals;
  if (size > arrivals.max_bytes) {
    ++arrivals.too_large;
    return nullptr;
  }
  Sample* const made = allocate(type, kind, size);
  if (made != nullptr && kind == SDK_DATA) ++arrivals.accepted;
  return made;
}

// No type has a key.
bool equal_keys(const ddsi_serdata*, const ddsi_serdata*) { return true; }
std::uint32_t size_of(const ddsi_serdata* data) { return static_cast<std::uint32_t>((sample(data).size + 3) / 4 * 4); }

ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment, std::size_t size) {
  Sample* const made = allocate_arrived(type, kind, size);
  std::size_t at = 0;
  for (; made != nullptr && fragment != nullptr; fragment = fragment->nextfrag) {
    const std::size_t end = std::min<std::size_t>(fragment->maxp1, size);
    // They may overlap.
    if (end <= at || fragment->min > at) continue;
    const unsigned char* const payload = NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    std::memcpy(made->bytes() + at, payload + (at - fragment->min), end - at);
    at = end;
  }
  if (made != nullptr) std::memset(made->bytes() + at, 0, made->size - at);
  return made;
}

ddsi_serdata* from_pieces(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count, const ddsrt_iovec_t* pieces,
                          std::size_t size) {
  Sample* const made = allocate_arrived(type, kind, size);
  std::size_t at = 0;
  for (std::size_t index = 0; made != nullptr && index < count; ++index) {
    const std::size_t length = std::min<std::size_t>(pieces[index].iov_len, size - at);
    std::memcpy(made->bytes() + at, pieces[index].iov_base, length);
    at += length;
  }
  if (made != nullptr) std::memset(made->bytes() + at, 0, made->size - at);
  return made;
}

ddsi_serdata* from_key(const ddsi_sertype* type, const ddsi_keyhash*) { return allocate(type, SDK_KEY, 0); }
// The gateway has no samples in another form.
ddsi_serdata* from_sample(const ddsi_sertype*, ddsi_serdata_kind, const void*) { return nullptr; }
bool to_sample(const ddsi_serdata*, void*, void**, void*) { return false; }
bool untyped_to_sample(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) { return false; }

void to_bytes(const ddsi_serdata* data, std::size_t offset, std::size_t size, void* to) {
  std::memcpy(to, sample(data).bytes() + offset, size);
}

ddsi_serdata* to_reference(const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* reference) {
  reference->iov_base = sample(data).bytes() + offset;
  reference->iov_len = size;
  return ddsi_serdata_ref(data);
}

void end_reference(ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); }

ddsi_serdata* to_untyped(const ddsi_serdata* data) {
  Sample* const made = allocate(data->type, SDK_KEY, 0);
  if (made != nullptr) made->type = nullptr;
  return made;
}

void free_sample(ddsi_serdata* data) { std::free(&sample(data)); }

std::size_t print(const ddsi_sertype*, const ddsi_serdata*, char* text, std::size_t size) {
  if (size > 0) text[0] = '\0';
  return 0;
}

void key_hash(const ddsi_serdata*, ddsi_keyhash* hash, bool) { std::memset(hash, 0, sizeof *hash); }

const ddsi_serdata_ops sample_operations = {
    equal_keys,   size_of,       from_fragments, from_pieces, from_key,          from_sample, to_bytes,
    to_reference, end_reference, to_sample,      to_untyped,  untyped_to_sample, free_sample, print,
    key_hash,
#ifdef DDS_HAS_SHM
    nullptr,      nullptr,
#endif
};

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete static_cast<SampleType*>(type);
}

void zero_samples(const ddsi_sertype*, void*, std::size_t) {}
void reallocate_samples(void**, const ddsi_sertype*, void*, std::size_t, std::size_t) {}
void free_samples(const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {}
// Each topic has a type of its own, since it has its own limit.
bool equal_types(const ddsi_sertype* one, const ddsi_sertype* other) {
  return static_cast<const SampleType*>(one)->arrivals == static_cast<const SampleType*>(other)->arrivals;
}
std::uint32_t hash_of_type(const ddsi_sertype*) { return 0; }

const ddsi_sertype_ops type_operations = {ddsi_sertype_v0, nullptr, free_type, zero_samples, reallocate_samples, free_samples, equal_types,
                                          hash_of_type,    nullptr, nullptr,   nullptr,      nullptr,            nullptr,      nullptr};

}  // namespace

ddsi_sertype* new_sample_type(const char* name, Arrivals& arrivals) {
  SampleType* const type = new SampleType();
  ddsi_sertype_init_flags(type, name, &type_operations, &sample_operations, DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  type->arrivals = &arrivals;
  return type;
}

ddsi_serdata* new_sample(const ddsi_sertype* type, std::size_t size) { return allocate(type, SDK_DATA, size); }

char* bytes_of(ddsi_serdata* data) { return sample(data).bytes(); }
std::size_t size_of_sample(const ddsi_serdata* data) { return sample(data).size; }

}  // namespace mauve
