"""Sets of measured data by a second code: other laws, other integration, other noise than the engine has.

Nothing here imports `mu_addon.evidence` but `judging`, which asks it for its verdicts.
"""
