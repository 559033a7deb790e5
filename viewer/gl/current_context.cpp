#include "viewer/gl/current_context.h"

namespace scanview {
namespace {

thread_local GlContext* current = nullptr;

}  // namespace

GlContext* current_context() { return current; }

bool begin_make_current(GlContext* context) {
  if (current == context) return false;
  if (current != nullptr) current->release();
  return true;
}

void set_current_context(GlContext* context) { current = context; }

}  // namespace scanview
