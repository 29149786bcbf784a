"""Many trials: the list, the pilots, the workers, progress, resume."""

from clearway.campaigns.campaign import CampaignInterrupted, check_plan, planned, resume_campaign, run_campaign
from clearway.campaigns.plan import CampaignPlan, TrialSpec

__all__ = [
    "CampaignInterrupted",
    "CampaignPlan",
    "TrialSpec",
    "check_plan",
    "planned",
    "resume_campaign",
    "run_campaign",
]
