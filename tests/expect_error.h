#pragma once
#include <gtest/gtest.h>

#include <string>

#include "base/error.h"

/// The statement throws scanview::Error with this code, and its line holds the text.
#define EXPECT_SCANVIEW_ERROR(statement, expected_code, text)                                     \
  try {                                                                                           \
    statement;                                                                                    \
    ADD_FAILURE() << "no error";                                                                  \
  } catch (scanview::Error const& error) {                                                        \
    EXPECT_EQ(error.code(), expected_code) << error.what();                                       \
    EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();           \
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "an error is one line"; \
  }
