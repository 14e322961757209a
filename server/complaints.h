// What the daemon does not like: each kind is said once, and all that is refused is counted.
#pragma once

#include "messages/base.h"

#include <stdbool.h>
#include <stdint.h>

typedef enum Complaint {
    COMPLAINT_POSE,
    COMPLAINT_CHARACTER,
    COMPLAINT_WIND,
    COMPLAINT_TUNING,
    COMPLAINT_UNSTABLE,
    COMPLAINT_FORCED,
    COMPLAINT_REQUEST,
    COMPLAINT_STATUS,
    COMPLAINT_CHANNEL,
    COMPLAINT_UNSENT,
    COMPLAINT_OVERFLOW,
    COMPLAINT_STYLE,
    COMPLAINT_EMPTY_SLOT,
    COMPLAINT_POSE_IN_CODE,
    COMPLAINT_QUARANTINE,
    COMPLAINT_JUMP,
    COMPLAINT_COUNT
} Complaint;

typedef struct Complaints {
    Notice notice;
    int64_t rejected;
    bool said[COMPLAINT_COUNT];
} Complaints;

// Of what was asked for in spite of a warning.
void complaints_warn(Complaints* complaints, Complaint kind, const char* text);
// Of what is odd, but taken; somebody counts it.
void complaints_remark(Complaints* complaints, Complaint kind, const char* text);
// Of what is refused.
void complaints_reject(Complaints* complaints, Complaint kind, const char* text);
