#include "server/complaints.h"

static void say_once(Complaints* complaints, Complaint kind, const char* text, const char* more)
{
    if (complaints->said[kind]) return;
    complaints->said[kind] = true;
    notice_say(&complaints->notice, "%s (said once%s)", text, more);
}

void complaints_warn(Complaints* complaints, Complaint kind, const char* text)
{
    say_once(complaints, kind, text, "");
}

void complaints_remark(Complaints* complaints, Complaint kind, const char* text)
{
    say_once(complaints, kind, text, "; later ones are counted");
}

void complaints_reject(Complaints* complaints, Complaint kind, const char* text)
{
    ++complaints->rejected;
    complaints_remark(complaints, kind, text);
}
