"""Many trials: the plan, its checks, the pilots, the pool of workers, progress, resume."""

from clearway.campaigns.campaign import planned, resume_campaign, run_campaign
from clearway.campaigns.interruption import CampaignInterrupted
from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.campaigns.plan_checks import check_plan

__all__ = [
    "CampaignInterrupted",
    "CampaignPlan",
    "TrialSpec",
    "check_plan",
    "planned",
    "resume_campaign",
    "run_campaign",
]
