#pragma once
#include "viewer/gl/gl_context.h"

namespace scanview {

/// The context that is current on this thread, nullptr where none is. GLX, EGL and OSMesa share the thread's slot
/// without knowing of each other, so every GlContext binds itself through these two.
GlContext* current_context();

/// To be called by make_current() of an implementation: releases another context of ours that is current. Returns
/// whether `context` still has to be bound.
bool begin_make_current(GlContext* context);
/// After binding succeeded (the context), or after it was released or failed (nullptr).
void set_current_context(GlContext* context);

}  // namespace scanview
