#include "server/complaints.h"

void complaints_remark(Complaints* complaints, Complaint kind, const char* text)
{
    if (complaints->said[kind]) return;
    complaints->said[kind] = true;
    notice_say(&complaints->notice, "%s (said once; later ones are counted)", text);
}

void complaints_reject(Complaints* complaints, Complaint kind, const char* text)
{
    ++complaints->rejected;
    complaints_remark(complaints, kind, text);
}
